#!/usr/bin/env python3
"""Man pages and bash completion from the programs' own --help, so that they cannot disagree.
Usage: help_pages.py OUT_FOLDER VERSION PROGRAM...   writes OUT/man1/NAME.1.gz and OUT/completions/NAME"""
import gzip, pathlib, re, subprocess, sys
from dataclasses import dataclass, field

EXIT_STATUS = (("0", "done"), ("1", "failed; the message says what, where, and what to do next"),
               ("2", "the command line is wrong"), ("130", "interrupted"))


@dataclass
class Option:
    names: list  # ["-o", "--output"]; a positional has one name without a dash
    value: str   # "TEXT REQUIRED", "INT in [1 - 9]"; empty for a flag
    text: str = ""

    def choices(self):
        """Words that the value may be: of {a,b} or {a->0,b->1}."""
        found = re.search(r"\{([^}]*)\}", self.value)
        return [word.split("->")[0] for word in found[1].split(",")] if found else []


@dataclass
class Help:
    words: list  # ["daylit-run", "pose"]
    about: str = ""
    usage: str = ""
    sections: dict = field(default_factory=dict)  # "Options" -> [Option]

    def options(self):
        return [o for o in self.sections.get("Options", []) if o.names[0].startswith("-")]


def readable(value):
    """CLI11's words for a value, without its internal numbers."""
    value = re.sub(r"^ENUM:value in (\{[^}]*\}) OR \{[^}]*\}", r"\1", value)
    value = re.sub(r"->\d+", "", value)
    value = re.sub(r"^[A-Z]+:(?=[A-Z]|\{)", "", value)
    return re.sub(r"\bREQUIRED\b", "(required)", value)


def split_entry(line):
    """(names and value, meaning): what it means stands at column 30, or on lines of its own below."""
    inline = len(line) > 30 and line[29] == " " and \
        not re.match(r"in \[|OR |x \d|\.\.\.|REQUIRED|[A-Z][a-z]+: --|--", line[30:])
    return (line[:30].strip(), line[30:].strip()) if inline else (line.strip(), "")


def parse(words, text):
    """The page of a program or command. Entries begin two columns in."""
    page, section = Help(words), None
    for line in text.splitlines():
        if line.startswith("Usage: "):
            page.usage = re.sub(r"^Usage: \S*?(daylit-)", r"\1", line)
        elif re.fullmatch(r"[A-Z][a-z]+:", line):
            section = page.sections.setdefault(line[:-1], [])
        elif section is None:
            page.about += line + "\n"
        elif re.match(r"  \S", line):
            head, meaning = split_entry(line)
            names, _, value = head.partition(" ")
            section.append(Option(names.split(","), readable(value), meaning))
        elif line.strip() and section:
            section[-1].text = (section[-1].text + " " + line.strip()).strip()
    return page


def read_help(words, program):
    done = subprocess.run([program, *words[1:], "--help"], capture_output=True, text=True, check=True)
    return parse(words, done.stdout)


def read_pages(program):
    """The program's own page, then one of each of its commands: those that it lists, and those that it names."""
    name = pathlib.Path(program).name
    main = read_help([name], program)
    commands = [c.names[0] for c in main.sections.get("Subcommands", [])]
    for word in re.findall(name + r" ([a-z][a-z-]+)", main.about):
        page = read_help([name, word], program)
        if page.usage.startswith(f"{name} {word}") and word not in commands:
            commands.append(word)
    return [main] + [read_help([name, c], program) for c in commands]


def roff(text):
    """Text without meaning to troff."""
    text = text.replace("\\", r"\e").replace("-", r"\-").replace("'", r"\(aq").replace("`", r"\(ga")
    return re.sub(r"^\.", r"\&.", text, flags=re.M)


def roff_entries(entries):
    for o in entries:
        yield ".TP"
        yield ", ".join(rf"\fB{roff(n)}\fR" for n in o.names) + (" " + roff(o.value) if o.value else "")
        yield roff(o.text) or r"\&"


def man_page(pages, version):
    main = pages[0]
    name, sentence = main.words[0], re.match(r"(.*?)(\.\s|$)", main.about, re.S)[1]
    lines = [f'.TH {name.upper()} 1 "" "daylit {version}" "User Commands"', ".SH NAME",
             rf"{roff(name)} \- {roff(sentence)}", ".SH SYNOPSIS"]
    for page in pages:
        lines += [rf"\fB{roff(' '.join(page.words))}\fR {roff(page.usage[len(' '.join(page.words)):].strip())}", ".br"]
    lines += [".SH DESCRIPTION", ".nf", roff(main.about.rstrip()), ".fi"]
    for title, entries in main.sections.items():
        lines += [f".SH {title.upper()}", *roff_entries(entries)]
    for page in pages[1:]:
        lines += [f".SH {roff(' '.join(page.words)).upper()}", ".nf", roff(page.about.rstrip()), ".fi"]
        lines += roff_entries([e for entries in page.sections.values() for e in entries])
    lines += [".SH EXIT STATUS"]
    for code, meaning in EXIT_STATUS:
        lines += [".TP", rf"\fB{code}\fR", roff(meaning)]
    return "\n".join(lines) + "\n"


def completion(pages):
    """A command's own options after its name; the words that an option takes after the option; files else."""
    name = pages[0].words[0]
    function = "_" + name.replace("-", "_")
    lines = [f"# bash completion of {name}, made from its --help", f"{function}() {{",
             '  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command=""',
             "  [[ $COMP_CWORD -gt 1 ]] && command=${COMP_WORDS[1]}", '  local words="" chosen=""', "  case $command in"]
    for page in [*pages[1:], pages[0]]:
        here = page.words[1] if len(page.words) > 1 else "*"
        lines += [f"  {here})", f"    words='{' '.join(n for o in page.options() for n in o.names)}'",
                  "    case $before in"]
        lines += [f"    {'|'.join(o.names)}) words='{' '.join(o.choices())}' chosen=1 ;;"
                  for o in page.options() if o.choices()]
        lines += ["    esac ;;"]
    commands = " ".join(p.words[1] for p in pages[1:])
    lines += ["  esac",
              '  if [[ $chosen || $word == -* ]]; then COMPREPLY=($(compgen -W "$words" -- "$word")); return; fi',
              '  mapfile -t COMPREPLY < <(compgen -f -- "$word")']
    if commands:
        lines += [f"  [[ $COMP_CWORD -eq 1 ]] && COMPREPLY+=($(compgen -W '{commands}' -- \"$word\"))"]
    return "\n".join([*lines, "}", f"complete -o filenames -F {function} {name}"]) + "\n"


def main():
    out, version, programs = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3:]
    (out / "man1").mkdir(parents=True, exist_ok=True)
    (out / "completions").mkdir(parents=True, exist_ok=True)
    for program in programs:
        pages = read_pages(program)
        name = pages[0].words[0]
        (out / "man1" / f"{name}.1.gz").write_bytes(gzip.compress(man_page(pages, version).encode(), 9, mtime=0))
        (out / "completions" / name).write_text(completion(pages))


main()
