#!/usr/bin/env python3
"""Draws the plots of `daylit-bench sh -o sh.json` as one SVG, or writes its tables as Markdown. Standard library only.

usage: plot_sh.py sh.json sh.svg
       plot_sh.py sh.json sh.md
"""
import json
import math
import sys

WIDTH, HEIGHT, MARGIN = 460, 320, 58
COLOURS = ["#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#7f7f7f"]


def decades(low, high):
    return range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)


def panel(x0, y0, title, x_label, y_label, series, y_floor=1e-17, y_ceiling=1e5):
    """series: list of (name, [(x, y), ...]); both axes logarithmic."""
    points = [(x, min(max(y, y_floor), y_ceiling)) for _, p in series for x, y in p if x > 0]
    xs, ys = decades(min(p[0] for p in points), max(p[0] for p in points)), decades(
        min(p[1] for p in points), max(p[1] for p in points))
    left, right, top, bottom = x0 + MARGIN, x0 + WIDTH - 26, y0 + 34, y0 + HEIGHT - 46

    def sx(x):
        return left + (math.log10(x) - xs[0]) / max(1, xs[-1] - xs[0]) * (right - left)

    def sy(y):
        y = min(max(y, y_floor), y_ceiling)
        return bottom - (math.log10(y) - ys[0]) / max(1, ys[-1] - ys[0]) * (bottom - top)

    out = [f'<text x="{left}" y="{y0 + 20}" class="title">{title}</text>',
           f'<text x="{(left + right) / 2}" y="{bottom + 36}" text-anchor="middle">{x_label}</text>',
           f'<text transform="translate({x0 + 14},{(top + bottom) / 2}) rotate(-90)" text-anchor="middle">{y_label}</text>']
    for d in xs:
        out.append(f'<path d="M{sx(10.0 ** d):.1f} {top}V{bottom}" class="grid"/>'
                   f'<text x="{sx(10.0 ** d):.1f}" y="{bottom + 16}" text-anchor="middle">{10 ** d if d >= 0 else 10.0 ** d:g}</text>')
    for d in ys[::max(1, len(ys) // 8)]:
        out.append(f'<path d="M{left} {sy(10.0 ** d):.1f}H{right}" class="grid"/>'
                   f'<text x="{left - 6}" y="{sy(10.0 ** d) + 4:.1f}" text-anchor="end">1e{d}</text>')
    for k, (name, line) in enumerate(series):
        colour = COLOURS[k % len(COLOURS)]
        path = " ".join(f"{'L' if i else 'M'}{sx(x):.1f} {sy(y):.1f}" for i, (x, y) in enumerate(line))
        out.append(f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="1.8"/>')
        out += [f'<circle cx="{sx(x):.1f}" cy="{sy(y):.1f}" r="2.4" fill="{colour}"/>' for x, y in line]
        out.append(f'<rect x="{left + 6}" y="{top + 5 + 15 * k}" width="10" height="10" fill="{colour}"/>'
                   f'<text x="{left + 20}" y="{top + 14 + 15 * k}" class="key">{name}</text>')
    return "\n".join(out)


def column(rows, x, y, scale=1.0):
    def get(row):
        for key in y.split("/"):
            row = row[key]
        return row * scale

    return [(row[x], get(row)) for row in rows]


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(str(c) for c in row) + " |" for row in rows]) + "\n\n"


def percent(x):
    return f"{100 * x:.4f} %" if x < 0.01 else f"{100 * x:.3g} %"


def markdown(d):
    m = d["machine"]
    out = f'{m["processor"]}, {m["vectors"]}, {m["compiler"]}; {m["clock"]}.\n\n'
    out += "Error of Y_lm relative to the largest value of the row, five latitudes, all orders:\n\n"
    out += table(["degree", "double", "float", "factorials, double", "factorials, float", "ns per Y_lm, batch"],
                 [[r["degree"]] + [f"{r[k]:.1e}" for k in ("error_double", "error_float", "error_factorials_double",
                                                          "error_factorials_float")] + [f'{r["ns_per_harmonic"]:.1f}']
                  for r in d["basis"]])
    out += "RGB image on a Gauss-Legendre grid, one thread; ratio = our time / three calls of the peer:\n\n"
    out += table(["degree", "round trip, double", "round trip, float image", "synthesis ms", "analysis ms",
                  "synthesis ratio", "analysis ratio"],
                 [[r["degree"], f'{r["round_trip_double"]:.1e}', f'{r["round_trip_float"]:.1e}',
                   f'{r["synthesis_ms"]:.3g}', f'{r["analysis_ms"]:.3g}']
                  + [f'{r["peer"][k]:.2f}' if "peer" in r else "-" for k in ("synthesis_ratio", "analysis_ratio")]
                  for r in d["transforms"]])
    out += "Rotation of one channel against evaluation in the rotated frame:\n\n"
    out += table(["degree", "largest error / rms", "ms"],
                 [[r["degree"], f'{r["max_error_over_rms"]:.1e}', f'{r["ms"]:.3g}'] for r in d["rotation"]])
    n = d["nine"]
    out += (f'Nine coefficients of {n["directions"]} directions (float): {n["ms"]:.2f} ms, '
            f'{100 * n["fraction_of_store_bandwidth"]:.0f} % of the store bandwidth of the same run.\n\n')
    if "lobe_maps" in d:
        maps, eight = d["lobe_maps"], d["eight_maps"]
        out += (f'Phong lobe maps of a 512 x 512 angular map ({maps["pixels"]} pixels), errors against direct summation in '
                f'{maps["compared_pixels"]} of them. Analysis to degree {maps["analysis_degree"]}: '
                f'{maps["analysis_ms"]:.0f} ms, choice of all degrees: {maps["degree_choice_ms"]:.0f} ms, direct summation '
                f'in double, not tuned, fifteen exponents sharing the cosines: about {maps["direct_summation_ms_per_map_estimated"]:.0f} '
                'ms per map.\n\n')
        out += table(["exponent", "degree", "needed", "mean error", "largest", "map ms", "order 35, exact",
                      "order 35, float factorials", "order 50, float factorials"],
                     [[f'{r["exponent"]:g}', r["degree"], r["needed_degree"]]
                      + [percent(r["mean_error"]), percent(r["max_error"]), f'{r["ms"]:.0f}']
                      + [percent(r[k]) for k in ("order_35_exact_mean_error", "order_35_float_factorials_mean_error",
                                                 "order_50_float_factorials_mean_error")] for r in maps["maps"]])
        out += (f'Eight maps of 512 x 1024 RGB pixels: {eight["ms"]:.0f} ms (analysis {eight["analysis_ms"]:.1f}, choice of '
                f'the degrees {eight["choice_ms"]:.1f}, synthesis {eight["synthesis_ms"]:.1f}), '
                f'{eight["ms_first_with_plans"]:.0f} ms when the tables are built too.\n\n')
        out += table(["exponent"] + [f"{e:g}" for e in eight["exponents"]],
                     [["degree"] + eight["degrees"], ["mean error"] + [percent(e) for e in eight["mean_errors"]]])
    return out


def main(source, target):
    with open(source, encoding="utf-8") as f:
        d = json.load(f)
    if target.endswith(".md"):
        with open(target, "w", encoding="utf-8") as f:
            f.write(markdown(d))
        return
    basis, transforms = d["basis"], d["transforms"]
    panels = [
        ("Error of Y_lm, relative to the row", "degree l", "error", [
            ("recurrence, double", column(basis, "degree", "error_double")),
            ("recurrence, float", column(basis, "degree", "error_float")),
            ("factorials, double", column(basis, "degree", "error_factorials_double")),
            ("factorials, float", column(basis, "degree", "error_factorials_float"))]),
        ("Round trip on a Gauss-Legendre grid", "degree", "largest error", [
            ("double", column(transforms, "degree", "round_trip_double")),
            ("float images", column(transforms, "degree", "round_trip_float"))]),
        ("RGB transform, one thread", "degree", "ms", [
            ("synthesis", column(transforms, "degree", "synthesis_ms")),
            ("analysis", column(transforms, "degree", "analysis_ms"))] + ([
                ("peer, 3 syntheses", column(transforms, "degree", "peer/synthesis_ms")),
                ("peer, 3 analyses", column(transforms, "degree", "peer/analysis_ms"))]
                if "peer" in transforms[0] else [])),
    ]
    if "lobe_maps" in d:
        maps = d["lobe_maps"]["maps"]
        panels.append(("Phong lobe maps: mean relative error", "exponent", "error", [
            ("order chosen", column(maps, "exponent", "mean_error")),
            ("order 35, exact", column(maps, "exponent", "order_35_exact_mean_error")),
            ("order 35, float factorials", column(maps, "exponent", "order_35_float_factorials_mean_error"))]))
    rows = (len(panels) + 1) // 2
    body = "\n".join(panel(WIDTH * (i % 2), HEIGHT * (i // 2), *p) for i, p in enumerate(panels))
    foot = f'{d["machine"]["processor"]}, {d["machine"]["vectors"]}, {d["machine"]["compiler"]}'
    with open(target, "w", encoding="utf-8") as f:
        f.write(f'<svg xmlns="http://www.w3.org/2000/svg" width="{2 * WIDTH}" height="{rows * HEIGHT + 24}" '
                'font-family="sans-serif" font-size="11">\n'
                '<style>.grid{stroke:#ddd;stroke-width:.7}.title{font-size:13px;font-weight:bold}.key{font-size:10px}</style>\n'
                f'<rect width="100%" height="100%" fill="white"/>\n{body}\n'
                f'<text x="{MARGIN}" y="{rows * HEIGHT + 12}">{foot}</text>\n</svg>\n')


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2])
