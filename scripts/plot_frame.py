#!/usr/bin/env python3
"""Time of a frame against its error, from the report of `daylit-bench frame`. Usage: plot_frame.py frame.json frame.svg

Needs nothing but Python. One mark per number of lights; both axes are logarithmic.
"""
import json
import math
import sys

WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 640, 420, 70, 60, 40
COLOURS = ["#1b6ca8", "#c8553d", "#588157", "#8d5a97", "#e09f3e", "#3d405b", "#2a9d8f", "#9b2226"]


def decades(low, high):
    return range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)


def main():
    report = json.load(open(sys.argv[1]))
    series = {}
    for row in report["rows"]:
        name = f"{row['object']}, {row['sky']}, {row['renderer']}"
        series.setdefault(name, []).append((row["moving"]["wall_ms"], 100 * row["error"], row["samples"]))
    times = [p[0] for s in series.values() for p in s]
    errors = [max(p[1], 1e-3) for s in series.values() for p in s]
    xs, ys = decades(min(times), max(times)), decades(min(errors), max(errors))

    def at(ms, percent):
        x = LEFT + (math.log10(ms) - xs[0]) / (xs[-1] - xs[0]) * (WIDTH - LEFT - 210)
        y = HEIGHT - BOTTOM - (math.log10(max(percent, 1e-3)) - ys[0]) / (ys[-1] - ys[0]) * (HEIGHT - BOTTOM - TOP)
        return x, y

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" font-family="sans-serif" font-size="12">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
           f'<text x="{LEFT}" y="22" font-size="14">Frame time against error (moving: new sky, picture and marker)</text>']
    for d in xs:
        x, y = at(10**d, 10**ys[0])
        out.append(f'<path d="M{x:.1f} {TOP}V{y:.1f}" stroke="#ddd"/><text x="{x:.1f}" y="{y + 18:.1f}" text-anchor="middle">{10**d:g}</text>')
    for d in ys:
        x, y = at(10**xs[0], 10**d)
        out.append(f'<path d="M{x:.1f} {y:.1f}H{WIDTH - 210}" stroke="#ddd"/><text x="{x - 6:.1f}" y="{y + 4:.1f}" text-anchor="end">{10**d:g}</text>')
    out.append(f'<text x="{(LEFT + WIDTH - 210) / 2}" y="{HEIGHT - 18}" text-anchor="middle">milliseconds per frame</text>')
    out.append(f'<text x="18" y="{HEIGHT / 2}" transform="rotate(-90 18 {HEIGHT / 2})" text-anchor="middle">error, % of the mean</text>')
    for k, (name, points) in enumerate(series.items()):
        colour = COLOURS[k % len(COLOURS)]
        places = [at(ms, e) for ms, e, _ in points]
        out.append(f'<polyline fill="none" stroke="{colour}" points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in places)}"/>')
        for (x, y), (_, _, samples) in zip(places, points):
            out.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"><title>{samples} lights</title></circle>')
        out.append(f'<text x="{WIDTH - 200}" y="{TOP + 14 + 18 * k}" fill="{colour}">{name}</text>')
    open(sys.argv[2], "w").write("\n".join(out) + "\n</svg>\n")


if __name__ == "__main__":
    main()
