#!/usr/bin/env python3
"""Plot and tables of `daylit-bench sequence -o docs/sequence.json` and `daylit-bench flicker -o docs/flicker.json`.
Needs nothing but Python.

usage: scripts/plot_sequence.py
Writes docs/sequence.svg, and the tables into docs/sequence.md between its <!-- NAME --> and <!-- end --> lines.
"""
import json
import os
import re

DOCS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "docs")
BARS = {"overcast": 0.04, "sun": 0.08, "shade": 0.08}
COLOURS = {"object": "#1b6ca8", "shadow": "#c8553d"}
WIDTH, HEIGHT, LEFT, TOP, BOTTOM, PANEL, GAP = 900, 300, 50, 40, 250, 260, 25


def percent(x, digits=2):
    return f"{100 * x:.{digits}f}"


def plot(scenes):
    most = 1.05 * max(f[r] for s in scenes for f in s["frames"] for r in COLOURS)
    sy = lambda v: BOTTOM - v / most * (BOTTOM - TOP)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    for i, s in enumerate(scenes):
        left = LEFT + i * (PANEL + GAP)
        frames = s["frames"]
        sx = lambda k: left + k / max(len(frames) - 1, 1) * PANEL
        out.append(f'<text x="{left}" y="26" font-size="14">{s["scene"]}</text>')
        for v in range(0, int(100 * most) + 1, 2):
            out.append(f'<path d="M{left} {sy(v / 100):.1f}h{PANEL}" stroke="#ddd"/>')
            if i == 0:
                out.append(f'<text x="{left - 6}" y="{sy(v / 100) + 4:.1f}" text-anchor="end">{v}</text>')
        out.append(f'<path d="M{left} {sy(BARS[s["scene"]]):.1f}h{PANEL}" stroke="#888" stroke-dasharray="5 4"/>')
        for region, colour in COLOURS.items():
            points = " ".join(f"{sx(k):.1f},{sy(f[region]):.1f}" for k, f in enumerate(frames))
            out.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
        out.append(f'<text x="{left + PANEL / 2}" y="{BOTTOM + 18}" text-anchor="middle">frame 0 to {len(frames) - 1}</text>')
    for k, (region, colour) in enumerate(COLOURS.items()):
        x = LEFT + 170 * k
        out.append(f'<path d="M{x} {HEIGHT - 16}h20" stroke="{colour}" stroke-width="2"/><text x="{x + 26}" y="{HEIGHT - 12}">{region} pixels</text>')
    out.append(f'<path d="M{LEFT + 340} {HEIGHT - 16}h20" stroke="#888" stroke-dasharray="5 4"/><text x="{LEFT + 366}" y="{HEIGHT - 12}">allowed over the whole sequence</text>')
    out.append(f'<text transform="translate(14,{(TOP + BOTTOM) / 2}) rotate(-90)" text-anchor="middle">error, % of the mean</text>')
    return "\n".join(out + ["</svg>"]) + "\n"


def table(head, lines):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] + ["| " + " | ".join(l) + " |" for l in lines])


def sequence_table(document):
    head = ["sky", "pixels", "number", "RMS error, %", "allowed, %", "bias, %", "truth's own error, %", "without the object, %", "masks, IoU"]
    return table(head, [[s["scene"], r, str(s[r]["pixels"]), percent(s[r]["relative_rms"]), f"{100 * BARS[s['scene']]:g}",
                         f"{100 * s[r]['bias']:+.2f}", percent(s[r]["truth_standard_error"]), percent(s[r]["no_object_rms"], 0),
                         f"{s['mask_iou']:.4f}"] for s in document["scenes"] for r in COLOURS])


def flicker_table(document):
    head = ["object", "sky", "flicker of the object, %", "of its shadow, %", "a step of the sky: shown by the next frame, %", "frames until within 1 %"]
    return table(head, [[r["object"], r["sky"], percent(r["flicker_object"], 3), percent(r["flicker_shadow"], 3),
                         percent(r["response"][0], 1), str(r["frames_to_99_percent"])] for r in document["rows"]])


def main():
    sequence = json.load(open(os.path.join(DOCS, "sequence.json")))
    flicker = json.load(open(os.path.join(DOCS, "flicker.json")))
    open(os.path.join(DOCS, "sequence.svg"), "w").write(plot(sequence["scenes"]))
    path = os.path.join(DOCS, "sequence.md")
    page = open(path).read()
    for name, text in (("sequence", sequence_table(sequence)), ("flicker", flicker_table(flicker))):
        page, found = re.subn(f"<!-- {name} -->.*?<!-- end -->", f"<!-- {name} -->\n{text}\n<!-- end -->", page, flags=re.S)
        if not found:
            raise SystemExit(f"{path}: no <!-- {name} --> block")
    open(path, "w").write(page)


if __name__ == "__main__":
    main()
