// Man pages, bash completion and the systemd unit against what the programs themselves say.

#include <cctype>
#include <filesystem>
#include <fstream>
#include <regex>
#include <vector>

#include <gtest/gtest.h>

#include "tests/packaging/shell.h"

namespace daylit {
namespace {

namespace fs = std::filesystem;

const fs::path kPrograms = fs::path(DAYLIT_BINARY_DIR) / "bin", kPages = fs::path(DAYLIT_BINARY_DIR) / "packaging",
               kUnit = fs::path(DAYLIT_SOURCE_DIR) / "packaging/daylit-run.service";

/// A program and, for its commands, the command's name.
struct Page {
  std::string program, command;
};

void PrintTo(const Page& page, std::ostream* out) { *out << page.program << " " << page.command; }

std::string help_of(const Page& page) {
  return shell((kPrograms / page.program).string() + " " + page.command + " --help").text;
}

/// Options at the start of a line of --help: "  -o,--output TEXT" gives both.
std::set<std::string> options_of(const std::string& help) {
  std::set<std::string> options;
  const std::regex line("^  (-[^ \n]*)", std::regex::ECMAScript | std::regex::multiline), name("--?[a-z0-9-]+");
  for (std::sregex_iterator l(help.begin(), help.end(), line), end; l != end; ++l) {
    const std::string names = (*l)[1];
    for (std::sregex_iterator n(names.begin(), names.end(), name); n != end; ++n)
      options.insert(n->str());
  }
  return options;
}

/// What the completion offers after "PROGRAM [COMMAND] before... word".
std::set<std::string> completions(const Page& page, const std::string& before, const std::string& word) {
  const std::string typed = page.program + " " + page.command + " " + before + " \"" + word + "\"";
  return words_of(shell("bash -c '. " + (kPages / "completions" / page.program).string() + "; COMP_WORDS=(" + typed +
                        "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _${0//-/_}; echo \"${COMPREPLY[@]}\"' " +
                        page.program)
                      .text);
}

std::string upper(std::string text) {
  for (char& c : text)
    c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

class Pages : public testing::TestWithParam<Page> {
protected:
  void SetUp() override {
    if (!fs::exists(kPrograms / GetParam().program))
      GTEST_SKIP() << GetParam().program << " is not part of this build";
  }
};

TEST_P(Pages, every_option_of_the_help_is_in_the_man_page_and_in_the_completion) {
  const std::set<std::string> options = options_of(help_of(GetParam()));
  ASSERT_TRUE(options.contains("--help"));
  std::string man = shell("zcat " + (kPages / "man1" / (GetParam().program + ".1.gz")).string()).text;
  man = std::regex_replace(man, std::regex(R"(\\-)"), "-");
  if (!GetParam().command.empty()) { // its own section
    const std::size_t at = man.find(".SH " + upper(GetParam().program + " " + GetParam().command));
    ASSERT_NE(at, std::string::npos);
    man = man.substr(at, man.find(".SH ", at + 1) - at);
  }
  const std::set<std::string> offered = completions(GetParam(), "", "-");
  for (const std::string& option : options) {
    EXPECT_NE(man.find("\\fB" + option + "\\fR"), std::string::npos) << option << " is not in the man page";
    EXPECT_TRUE(offered.contains(option)) << option << " is not completed";
  }
  EXPECT_EQ(offered, options) << "and nothing else is offered";
}

INSTANTIATE_TEST_SUITE_P(Programs, Pages,
                         testing::Values(Page{"daylit-precompute", ""}, Page{"daylit-precompute", "check"},
                                         Page{"daylit-probe", ""}, Page{"daylit-simulate", ""},
                                         Page{"daylit-simulate", "irradiance"}, Page{"daylit-run", ""},
                                         Page{"daylit-run", "pose"}, Page{"daylit-run", "cameras"},
                                         Page{"daylit-run", "record"}, Page{"daylit-run", "doctor"},
                                         Page{"daylit-simulate", "photographs"}, Page{"daylit-simulate", "hand-held"},
                                         Page{"daylit-simulate", "develop"}, Page{"daylit-calibrate", ""},
                                         Page{"daylit-calibrate", "print"}, Page{"daylit-calibrate", "fisheye"},
                                         Page{"daylit-calibrate", "camera"}, Page{"daylit-calibrate", "response"},
                                         Page{"daylit-calibrate", "merge"}, Page{"daylit-calibrate", "colour"},
                                         Page{"daylit-calibrate", "vignette"}, Page{"daylit-calibrate", "align"},
                                         Page{"daylit-calibrate", "room"}, Page{"daylit-calibrate", "materials"},
                                         Page{"daylit-calibrate", "probe-stitch"}, Page{"daylit-bench", ""},
                                         Page{"daylit-bench", "frame"}));

TEST(Completion, offers_the_values_of_an_option_and_the_commands_of_a_program) {
  EXPECT_EQ(completions({"daylit-precompute", ""}, "--density", ""),
            (std::set<std::string>{"graded", "regular", "auto"}));
  EXPECT_EQ(completions({"daylit-probe", ""}, "--layout", "unr"), std::set<std::string>{"unreal"});
  EXPECT_TRUE(completions({"daylit-precompute", ""}, "", "che").contains("check"));
}

/// troff reports what it does not understand.
TEST(ManPage, is_formatted_without_a_warning) {
  if (shell("command -v groff").exit_code != 0)
    GTEST_SKIP() << "groff is not installed";
  for (const auto& page : fs::directory_iterator(kPages / "man1"))
    EXPECT_EQ(shell("zcat " + page.path().string() + " | groff -man -Tutf8 -ww -z").text, "") << page.path();
}

std::string unit_text() {
  std::ifstream file(kUnit);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(SystemdUnit, is_understood_by_systemd) {
  if (shell("command -v systemd-analyze").exit_code != 0)
    GTEST_SKIP() << "systemd-analyze is not installed";
  const std::string copy = (fs::temp_directory_path() / "daylit-run.service").string();
  // The program's place is not known before it is installed.
  std::ofstream(copy) << std::regex_replace(unit_text(), std::regex("ExecStart=daylit-run"), "ExecStart=/bin/true");
  const ShellOutcome checked = shell("systemd-analyze verify --man=no " + copy);
  EXPECT_EQ(checked.text, "");
  EXPECT_EQ(checked.exit_code, 0);
  fs::remove(copy);
}

/// Without these the unit still starts, so nothing else would notice that they went.
TEST(SystemdUnit, waits_for_the_first_word_of_the_daemon_feeds_a_watchdog_and_is_confined) {
  const std::string unit = unit_text();
  for (const std::string line :
       {"Type=notify", "WatchdogSec=", "Restart=always", "ExecReload=kill -HUP", "DynamicUser=yes",
        "ProtectSystem=strict", "NoNewPrivileges=yes", "SystemCallFilter=@system-service", "CapabilityBoundingSet=\n"})
    EXPECT_NE(unit.find("\n" + line), std::string::npos) << line;
}

} // namespace
} // namespace daylit
