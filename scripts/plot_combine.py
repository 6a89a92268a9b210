#!/usr/bin/env python3
"""Tables of docs/combine.md. Needs nothing but Python.

usage: scripts/plot_combine.py
Reads docs/combine.json, docs/combine-volume.json and docs/sky-projection.json, as daylit-bench writes them with -o, and
writes the tables into docs/combine.md between its <!-- combine:NAME --> and <!-- end --> lines.
"""
import json
import os
import re

DOCS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "docs")


def read(name):
    with open(os.path.join(DOCS, name), encoding="utf-8") as file:
        return json.load(file)


def table(head, rows):
    line = lambda cells: "| " + " | ".join(cells) + " |"
    return "\n".join([line(head), line(["---"] * len(head))] + [line(r) for r in rows])


def tiles():
    rows = []
    for r in read("combine.json")["rows"]:
        for storage in ("float32", "fixed16"):
            s = r[storage]
            rows.append([f"{r['regions']} x {r['grid']}^3", storage, f"{s['megabytes']:.1f}", f"{s['read_ms']:.4f}",
                         f"{s['full_ms']:.4f}", f"{100 * s['of_plain_read']:.0f}", f"{s['object_us']:.1f}",
                         f"{s['changed_regions']}: {s['step_us']:.1f}", f"{s['step_over_bound']:.2f}",
                         f"{s['unchanged_us']:.1f}",
                         f"{r['fixed16_error_of_max']:.1e}" if storage == "fixed16" else ""])
    return table(["volume", "storage", "MB", "plain read, ms", "combined, ms", "of plain read, %", "64 probes, us",
                  "changed: us", "of its bound", "unchanged, us", "error of the largest"], rows)


def volume():
    row = read("combine-volume.json")["rows"][0]
    parts = [["the whole volume, all threads", f"{row['combine_ms']:.3f} ms"],
             ["the same, one core", f"{row['combine_one_core_ms']:.3f} ms"],
             ["of it the light on the surfaces", f"{row['first_light_ms']:.3f} ms"],
             ["plain read of the factors, one core", f"{row['read_ms']:.3f} ms"]]
    for o in row["objects"]:
        parts.append([f"{o['probes']} probes of an object, rank {o['rank']}",
                      f"{o['frame_us']:.1f} us per sky, {o['move_ms']:.0f} ms after a move"
                      f" ({o['without_us']:.0f} us without tables); error {100 * o['error']:.2f} %"])
    return table([f"{row['volume_megabytes']:.1f} MB", "time"], parts)


def projection():
    rows = [[r["name"], f"{r['table_megabytes']:.2f}", f"{r['sweep_warm_ms']:.3f}", f"{r['warm_ms']:.3f}",
             f"{r['warm_over_sweep']:.2f}", f"{r['sweep_cold_ms']:.3f}", f"{r['cold_ms']:.3f}",
             f"{r['cold_over_sweep']:.2f}"] for r in read("sky-projection.json")["rows"]]
    return table(["partition", "tables, MB", "warm sweep, ms", "reduced, ms", "ratio", "cold sweep, ms", "reduced, ms",
                  "ratio"], rows)


def main():
    path = os.path.join(DOCS, "combine.md")
    with open(path, encoding="utf-8") as file:
        page = file.read()
    for key, text in (("tiles", tiles()), ("volume", volume()), ("projection", projection())):
        page, found = re.subn(rf"(<!-- combine:{key} -->\n).*?(<!-- end -->)", lambda m: m[1] + text + "\n" + m[2],
                              page, flags=re.S)
        if found != 1:
            raise SystemExit(f"{path}: no place for the table '{key}'")
    with open(path, "w", encoding="utf-8") as file:
        file.write(page)


if __name__ == "__main__":
    main()
