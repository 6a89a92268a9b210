#!/usr/bin/env python3
"""Plot and tables of `daylit-bench frame` and `daylit-bench direct` (docs/frame.md says which command makes which JSON).
Needs nothing but Python.

usage: scripts/plot_frame.py
Reads docs/frame.json (number of lights), docs/frame-rays.json, docs/frame-gl.json (table 1 of the paper), docs/frame-maps.json (side
of the shadow maps), docs/frame-gpu.json (a graphics card) and docs/direct.json;
writes docs/frame.svg, and the tables into docs/frame.md between its <!-- NAME --> and <!-- end --> lines.
"""
import json
import math
import os
import re

DOCS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "docs")
WIDTH, HEIGHT, LEFT, BOTTOM, TOP, LEGEND = 640, 420, 70, 60, 40, 210
COLOURS = ["#1b6ca8", "#c8553d", "#588157", "#8d5a97", "#e09f3e", "#3d405b", "#2a9d8f", "#9b2226"]
MOTIONS = ["moving", "object moving", "nothing changed"]
BARS_MS = {("rays", "teapot"): (1000 / 35, 1000 / 45), ("rays", "blob"): (1000 / 25, 1000 / 30),
           ("gl", "teapot"): (1000 / 20, None), ("gl", "blob"): (1000 / 13, None)}


def load(name):
    return json.load(open(os.path.join(DOCS, name)))


def decades(low, high):
    return range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)


def grid(xs, ys, at):
    out = []
    for d in xs:
        x, y = at(10**d, 10**ys[0])
        out.append(f'<path d="M{x:.1f} {TOP}V{y:.1f}" stroke="#ddd"/><text x="{x:.1f}" y="{y + 18:.1f}" text-anchor="middle">{10**d:g}</text>')
    for d in ys:
        x, y = at(10**xs[0], 10**d)
        out.append(f'<path d="M{x:.1f} {y:.1f}H{WIDTH - LEGEND}" stroke="#ddd"/><text x="{x - 6:.1f}" y="{y + 4:.1f}" text-anchor="end">{10**d:g}</text>')
    return out


def plot(rows):
    series = {}
    for row in rows:
        series.setdefault(f"{row['object']}, {row['sky']}, {row['renderer']}", []).append(
            (row["moving"]["wall_ms"], max(100 * row["error"], 1e-3), row["samples"]))
    points = [p for s in series.values() for p in s]
    xs = decades(min(p[0] for p in points), max(p[0] for p in points))
    ys = decades(min(p[1] for p in points), max(p[1] for p in points))
    along = lambda value, axis: (math.log10(value) - axis[0]) / (axis[-1] - axis[0])
    at = lambda ms, percent: (LEFT + along(ms, xs) * (WIDTH - LEFT - LEGEND), HEIGHT - BOTTOM - along(percent, ys) * (HEIGHT - BOTTOM - TOP))
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
           f'<text x="{LEFT}" y="22" font-size="14">Frame time against error (moving: new sky, picture and marker)</text>', *grid(xs, ys, at),
           f'<text x="{(LEFT + WIDTH - LEGEND) / 2}" y="{HEIGHT - 18}" text-anchor="middle">milliseconds per frame</text>',
           f'<text x="18" y="{HEIGHT / 2}" transform="rotate(-90 18 {HEIGHT / 2})" text-anchor="middle">error, % of the mean</text>']
    for k, (name, points) in enumerate(series.items()):
        colour = COLOURS[k % len(COLOURS)]
        places = [at(ms, e) for ms, e, _ in points]
        out.append(f'<polyline fill="none" stroke="{colour}" points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in places)}"/>')
        for (x, y), (_, _, samples) in zip(places, points):
            out.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"><title>{samples} lights</title></circle>')
        out.append(f'<text x="{WIDTH - LEGEND + 10}" y="{TOP + 14 + 18 * k}" fill="{colour}">{name}</text>')
    return "\n".join(out) + "\n</svg>\n"


def table(head, lines):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] + ["| " + " | ".join(l) + " |" for l in lines])


def milliseconds(x):
    return "< 0.01" if x < 0.01 else f"{x:.1f}" if x < 100 else f"{x:.0f}"


def times(row, motion):
    t = row[motion]
    return f"{milliseconds(t['wall_ms'])} / {milliseconds(t['cpu_ms'])}"


def table_one(rows):
    head = ["renderer", "object", "sky", "covers, %", *(f"{m}, ms" for m in MOTIONS), "wanted: moving, object moving, ms", "error of the lights, %"]
    wanted = lambda row: ", ".join("" if b is None else f"{b:.1f}" for b in BARS_MS[row["renderer"], row["object"]]).rstrip(", ")
    return table(head, [[row["renderer"], row["object"], row["sky"], f"{100 * row['object_fraction']:.1f}", *(times(row, m) for m in MOTIONS),
                         wanted(row), f"{100 * row['error']:.2f}"] for row in rows])


def stages(rows):
    names = sorted({n for row in rows for m in MOTIONS[:2] for n in row[m]["stage_ms"]} - {"compare"})
    return table(["renderer", "object", "frame", *(n.replace("_", " ") for n in names)],
                 [[row["renderer"], row["object"], m, *(f"{row[m]['stage_ms'][n]:.1f}" if n in row[m]["stage_ms"] else "" for n in names)]
                  for row in rows for m in MOTIONS[:2]])


def lights(rows):
    return table(["object", "sky", "renderer", "lights", "moving, ms", "error of the lights, %", "flicker, %"],
                 [[row["object"], row["sky"], row["renderer"], str(row["samples"]), times(row, "moving"), f"{100 * row['error']:.2f}",
                   f"{100 * row['flicker']:.3f}"] for row in rows])


def maps(rows):
    return table(["object", "texels a side", "moving, ms", "error of the lights, %"],
                 [[row["object"], str(row["map_texels"]), times(row, "moving"), f"{100 * row['error']:.2f}"] for row in rows])


def card(rows):
    return table(["threads", "sky", "renderer", "moving, ms", "object moving, ms", "drawing alone, ms", "error of the lights, %"],
                 [[str(row["threads"]), row["sky"], row["renderer"], times(row, "moving"), times(row, "object moving"),
                   f"{row['moving']['stage_ms']['render']:.1f}", f"{100 * row['error']:.2f}"] for row in rows])


def direct(document):
    counts = sorted({r["samples"] for r in document["overcast"]})
    objects = list(dict.fromkeys(r["object"] for r in document["overcast"]))
    error = {(r["object"], r["samples"]): r["error"] for r in document["overcast"]}
    return table(["object", *(f"{n} lights" for n in counts)], [[o, *(f"{100 * error[o, n]:.2f}" for n in counts)] for o in objects])


def clipping(document):
    return table(["object", "lights", "clipped to the windows, %", "of the whole picture, %", "ratio"],
                 [[r["object"], str(r["samples"]), f"{100 * r['clipped']:.1f}", f"{100 * r['whole_picture']:.0f}",
                   f"{r['clipped'] / r['whole_picture']:.3f}"] for r in document["clipping"]])


def main():
    sweep, rays, gl, sizes, points, gpu = (load(f"{n}.json") for n in ("frame", "frame-rays", "frame-gl", "frame-maps", "direct", "frame-gpu"))
    open(os.path.join(DOCS, "frame.svg"), "w").write(plot(sweep["rows"] + gl["rows"]))
    path = os.path.join(DOCS, "frame.md")
    page = open(path).read()
    both = rays["rows"] + gl["rows"]
    for name, text in {"table-one": table_one(both), "stages": stages(both), "lights": lights(sweep["rows"]), "maps": maps(sizes["rows"]), "card": card(gpu["rows"]), "direct": direct(points),
                       "clipping": clipping(points)}.items():
        page, found = re.subn(f"<!-- {name} -->.*?<!-- end -->", lambda _: f"<!-- {name} -->\n{text}\n<!-- end -->", page, flags=re.S)
        if not found:
            raise SystemExit(f"{path}: no <!-- {name} --> block")
    open(path, "w").write(page)


if __name__ == "__main__":
    main()
