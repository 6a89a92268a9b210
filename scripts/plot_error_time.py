#!/usr/bin/env python3
"""Plot and tables of `daylit-bench error-vs-time -o docs/error-time.json`. Needs nothing but Python.

usage: scripts/plot_error_time.py [JSON SVG PAGE]
Writes the SVG, and the tables into the page between its <!-- error-time:NAME --> and <!-- end --> lines.
"""
import json
import math
import os
import re
import sys

DOCS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "docs")
WIDTH, HEIGHT, TOP, BOTTOM = 860, 400, 44, 340
PANELS = ((62, 360), (420, 718))
COLOURS = ["#1b6ca8", "#c8553d", "#588157", "#8d5a97", "#e09f3e", "#3d405b"]
NAMES = {"s1_daylit_cornell": "S1", "s3_furnace": "S3", "office": "two windows", "l_shape": "L-shaped",
         "storeys": "three rooms"}
SMOOTH_BAR, SUN_BAR = 0.02, 0.04


def name(row):
    return NAMES.get(row["room"], row["room"])


def worst(row, small_sun, key):
    values = [s[key] for s in row["skies"] if s["small_sun"] == small_sun]
    return max(values) if values else None


def ticks(low, high):
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    return [m * 10.0**d for d in range(first, last + 1) for m in (1, 2, 5) if low <= m * 10.0**d <= high]


def plot(rows):
    rooms = list(dict.fromkeys(r["room"] for r in rows))
    times = [r["cpu_seconds"] for r in rows]
    errors = [100 * worst(r, sun, "irradiance") for r in rows for sun in (False, True)]
    x_low, x_high, y_low, y_high = min(times) / 1.3, max(times) * 1.3, min(errors) / 1.3, max(errors) * 1.3
    sy = lambda v: BOTTOM - math.log(v / y_low) / math.log(y_high / y_low) * (BOTTOM - TOP)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    for (left, right), sun, title in zip(PANELS, (False, True), ("smooth skies", "skies with a small sun")):
        sx = lambda v: left + math.log(v / x_low) / math.log(x_high / x_low) * (right - left)
        out.append(f'<text x="{left}" y="26" font-size="14">Worst of the {title}</text>')
        for v in ticks(x_low, x_high):
            out.append(f'<path d="M{sx(v):.1f} {TOP}V{BOTTOM}" stroke="#ddd"/><text x="{sx(v):.1f}" y="{BOTTOM + 18}" text-anchor="middle">{v:g}</text>')
        for v in ticks(y_low, y_high):
            out.append(f'<path d="M{left} {sy(v):.1f}H{right}" stroke="#ddd"/><text x="{left - 6}" y="{sy(v) + 4:.1f}" text-anchor="end">{v:g}</text>')
        bar = 100 * (SUN_BAR if sun else SMOOTH_BAR)
        if y_low < bar < y_high:
            out.append(f'<path d="M{left} {sy(bar):.1f}H{right}" stroke="#888" stroke-dasharray="5 4"/>')
        out.append(f'<text x="{(left + right) / 2}" y="{HEIGHT - 16}" text-anchor="middle">processor time of the bake, all threads, s</text>')
        for room, colour in zip(rooms, COLOURS):
            points = sorted((r["cpu_seconds"], 100 * worst(r, sun, "irradiance")) for r in rows if r["room"] == room)
            path = " ".join(f"{'L' if i else 'M'}{sx(x):.1f} {sy(y):.1f}" for i, (x, y) in enumerate(points))
            out.append(f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="1.8"/>')
            out += [f'<circle cx="{sx(x):.1f}" cy="{sy(y):.1f}" r="3.2" fill="{colour}"/>' for x, y in points]
    out.append(f'<text transform="translate(16,{(TOP + BOTTOM) / 2}) rotate(-90)" text-anchor="middle">error of the indirect irradiance, % nrms</text>')
    for k, (room, colour) in enumerate(zip(rooms, COLOURS)):
        y = TOP + 14 + 18 * k
        out.append(f'<path d="M734 {y - 4}h20" stroke="{colour}" stroke-width="1.8"/><text x="760" y="{y}">{NAMES.get(room, room)}</text>')
    return "\n".join(out + ["</svg>"]) + "\n"


def table(head, lines):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] + ["| " + " | ".join(l) + " |" for l in lines])


def percent(x, digits=1):
    return "" if x is None else f"{100 * x:.{digits}f}"


def cost_table(rows):
    head = ["room", "asked, %", "smooth skies, %", "small sun, %", "processor time, s", "file, MB", "combine, ms"]
    return table(head, [[name(r), f"{100 * r['target']:g}", percent(worst(r, False, "irradiance")), percent(worst(r, True, "irradiance")),
                         f"{r['cpu_seconds']:.1f}", f"{r['file_bytes'] / 1e6:.1f}", f"{r['combine_ms']:.2f}"] for r in rows])


def sky_table(rows):
    rows = [r for r in rows if r["target"] == 0.02]
    skies = list(dict.fromkeys(s["sky"] for r in rows for s in r["skies"]))
    lines = []
    for sky in skies:
        line = [sky]
        for r in rows:
            s = next((s for s in r["skies"] if s["sky"] == sky), None)
            line.append(f"{percent(s['irradiance'])}, {percent(s['coefficients'])} ± {percent(s['reference_irradiance'])}, {percent(s['reference_coefficients'])}" if s else "")
        bar = SUN_BAR if any(s["small_sun"] for r in rows for s in r["skies"] if s["sky"] == sky) else SMOOTH_BAR
        lines.append(line + [f"{100 * bar:g} %"])
    return table(["sky"] + [name(r) for r in rows] + ["bar"], lines)


def plan_table(rows):
    head = ["room", "asked, %", "error: predicted, %", "measured, %", "small sun: predicted, %", "measured, %", "time: predicted, s", "measured, s", "file: predicted, MB", "measured, MB"]
    lines = []
    for r in rows:
        p, m = r["predicted"], r["measured"]
        lines.append([name(r), f"{100 * r['target']:g}", percent(p["error"], 2), percent(m["error"], 2), percent(p["sun"]), percent(m["sun"]),
                      f"{p['seconds']:.1f}", f"{r['wall_seconds']:.1f}", f"{p['bytes'] / 1e6:.1f}", f"{r['file_bytes'] / 1e6:.1f}"])
    return table(head, lines)


def main():
    source, picture, page = sys.argv[1:] or (os.path.join(DOCS, n) for n in ("error-time.json", "error-time.svg", "performance.md"))
    with open(source) as f:
        rows = json.load(f)["rows"]
    with open(picture, "w") as f:
        f.write(plot(rows))
    with open(page) as f:
        text = f.read()
    for key, made in (("cost", cost_table(rows)), ("skies", sky_table(rows)), ("plan", plan_table(rows))):
        text = re.sub(rf"(<!-- error-time:{key} -->\n).*?(<!-- end -->)", lambda m: m.group(1) + made + "\n" + m.group(2), text, flags=re.S)
    with open(page, "w") as f:
        f.write(text)


main()
