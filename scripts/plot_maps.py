#!/usr/bin/env python3
"""Plot and tables of `daylit-bench maps` (docs/maps.md says with which options). Needs nothing but Python.

usage: scripts/plot_maps.py
Reads docs/maps.json; writes docs/maps.svg, and the tables into docs/maps.md between its <!-- NAME --> and <!-- end --> lines.
"""
import json
import math
import os
import re

DOCS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "docs")
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 430, 340, 64, 20, 62, 54
COLOURS = {"mip chain": "#c8553d", "harmonics": "#1b6ca8", "exact": "#588157"}


def decades(low, high):
    return range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)


def panel(x0, probe):
    eight = probe["eight_maps"]
    points = {name: [(m["ms"], row["mean"], s) for s, row in zip(eight["exponents"], m["maps"])]
              for name, m in eight["methods"].items()}
    times = [m["ms"] for m in eight["methods"].values()] + [eight["plain_ms"]]
    errors = [e for p in points.values() for _, e, _ in p]
    xs, ys = decades(min(times) / 2, max(times)), decades(min(errors), max(errors))
    left, right, top, bottom = x0 + LEFT, x0 + WIDTH - RIGHT, TOP, HEIGHT - BOTTOM
    sx = lambda v: left + (math.log10(v) - xs[0]) / (xs[-1] - xs[0]) * (right - left)
    sy = lambda v: bottom - (math.log10(v) - ys[0]) / (ys[-1] - ys[0]) * (bottom - top)
    out = [f'<text x="{left}" y="24" font-size="14">{probe["name"]}</text>',
           f'<text x="{left}" y="42">eight maps of 512 x 512; dots: exponents 1 to 1280</text>',
           f'<text x="{(left + right) / 2}" y="{HEIGHT - 14}" text-anchor="middle">milliseconds of processor for all eight</text>',
           f'<text transform="translate({x0 + 16},{(top + bottom) / 2}) rotate(-90)" text-anchor="middle">mean relative error</text>']
    for d in xs:
        out.append(f'<path d="M{sx(10.0**d):.1f} {top}V{bottom}" stroke="#ddd"/>'
                   f'<text x="{sx(10.0**d):.1f}" y="{bottom + 16}" text-anchor="middle">{10**d}</text>')
    for d in ys:
        out.append(f'<path d="M{left} {sy(10.0**d):.1f}H{right}" stroke="#ddd"/>'
                   f'<text x="{left - 6}" y="{sy(10.0**d) + 4:.1f}" text-anchor="end">1e{d}</text>')
    for name, p in points.items():
        out += [f'<circle cx="{sx(t):.1f}" cy="{sy(e):.1f}" r="3.5" fill="{COLOURS[name]}" fill-opacity=".6"><title>{s:g}</title></circle>'
                for t, e, s in p]
        out.append(f'<text x="{sx(p[0][0]):.1f}" y="{sy(max(e for _, e, _ in p)) - 8:.1f}" text-anchor="middle" fill="{COLOURS[name]}">{name}</text>')
    out.append(f'<path d="M{sx(eight["plain_ms"]):.1f} {top}V{bottom}" stroke="#333" stroke-dasharray="4 3"/>'
               f'<text x="{sx(eight["plain_ms"]) - 5:.1f}" y="{top + 12}" text-anchor="end">plain sum</text>')
    return "\n".join(out)


def table(head, lines):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
                     + ["| " + " | ".join(str(c) for c in line) + " |" for line in lines])


def percent(x):
    return f"{100 * x:.2g} %" if x < 0.1 else f"{100 * x:.0f} %"


def eight_table(probe):
    e = probe["eight_maps"]
    head = ["", "processor / elapsed ms"] + [f"s = {s:g}" for s in e["exponents"]] + ["mean of eight"]
    lines = []
    for name, m in e["methods"].items():
        lines.append([f"{name}, mean", f'{m["ms"]:.0f} / {m["wall_ms"]:.0f}'] + [f'{r["mean"]:.1e}' for r in m["maps"]] + [f'{m["mean_error"]:.1e}'])
        lines.append([f"{name}, 95 %", ""] + [f'{r["percentile_95"]:.1e}' for r in m["maps"]] + [""])
        lines.append([f"{name}, largest", ""] + [f'{r["largest"]:.1e}' for r in m["maps"]] + [""])
        lines.append([f"{name}, mean / mean of map", ""] + [f'{r["mean_over_mean_of_map"]:.1e}' for r in m["maps"]] + [""])
    lines.append(["resampling, mean", ""] + [f'{r["mean"]:.1e}' for r in e["resampling"]] + [""])
    return (f'**{probe["name"]}**, brightest texel {e["largest_over_mean"]:.0f} times the mean. Plain sum of all eight: '
            f'{e["plain_ms"] / 1e3:.1f} s; the exact method takes {100 * e["exact_over_plain"]:.1f} % of it, from exponent 40 on '
            f'{100 * e["exact_over_plain_from_exponent_40"]:.1f} %.\n\n' + table(head, lines))


def pair(row):
    return f'{percent(row["mean"])} / {percent(row["largest"])}'


def thesis_tables(probe):
    t = probe.get("thesis")
    if not t:
        return ""
    s = t["exponents"]
    out = [f'### {probe["name"]}', "Tables 6.1 and 6.2, mean / largest:",
           table(["s", "thesis' mip maps", "order 35", "mip chain", "harmonics", "exact"],
                 [[f"{s[k]:g}", pair(t["methods"]["thesis mip maps"][k]), pair(t["orders"]["35"][k]),
                   pair(t["methods"]["mip chain"][k]), pair(t["methods"]["harmonics"][k]), pair(t["methods"]["exact"][k])]
                  for k in range(len(s))]),
           "Table 6.3, one thread, ms:",
           table(["order"] + [str(r["order"]) for r in t["order_times"]],
                 [["coefficients"] + [f'{r["analysis_ms"]:.0f}' for r in t["order_times"]],
                  ["eight maps"] + [f'{r["eight_maps_ms"]:.0f}' for r in t["order_times"]]]),
           "Tables 6.4 and 6.5, mean error of the series cut at an order:",
           table(["s"] + list(t["orders"]), [[f"{s[k]:g}"] + [percent(c[k]["mean"]) for c in t["orders"].values()] for k in range(len(s))]),
           "Table 6.6, ms of one exact map (tolerance 1e-5):",
           table(["s"] + [f'{r["exponent"]:g}' for r in t["bounds_times"]], [["ms"] + [f'{r["exact_ms"]:.0f}' for r in t["bounds_times"]]]),
           "Tables 6.7 and 6.8, squares of fixed width in the angular map, mean / largest:",
           table(["s"] + [f"bounds for {b}" for b in t["fixed_bounds"]],
                 [[f"{s[k]:g}"] + [pair(c[k]) for c in t["fixed_bounds"].values()] for k in range(len(s))])]
    return "\n\n".join(out)


def main():
    with open(os.path.join(DOCS, "maps.json"), encoding="utf-8") as f:
        d = json.load(f)
    m = d["machine"]
    tables = {"eight": "\n\n".join([f'{m["processor"]}, {m["vectors"]}, {m["compiler"]}; {m["clock"]}.'] + [eight_table(p) for p in d["probes"]]),
              "thesis": "\n\n".join(filter(None, (thesis_tables(p) for p in d["probes"])))}
    page = os.path.join(DOCS, "maps.md")
    with open(page, encoding="utf-8") as f:
        text = f.read()
    for name, content in tables.items():
        text = re.sub(rf"(<!-- {name} -->\n).*?(<!-- end -->)", lambda found: found[1] + content + "\n" + found[2], text, flags=re.S)
    with open(page, "w", encoding="utf-8") as f:
        f.write(text)
    panels = "\n".join(panel(WIDTH * k, p) for k, p in enumerate(d["probes"]))
    width = WIDTH * len(d["probes"])
    with open(os.path.join(DOCS, "maps.svg"), "w", encoding="utf-8") as f:
        f.write(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {HEIGHT}" font-family="sans-serif" font-size="11">\n'
                f'<rect width="{width}" height="{HEIGHT}" fill="white"/>\n{panels}\n</svg>\n')


main()
