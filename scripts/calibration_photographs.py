"""What daylit-calibrate makes of photographs by others, in ../shared/data. Part "photographs" of scripts/measure-calibration."""
import math, os

import numpy as np

from calibration_inputs import DEGREE, chart_codes, chart_light, tool


def photographs(o, folder):
    """Lens, response, colours and illuminance from the photographs of ../shared/data."""
    for command, name, board in (("fisheye", "fisheye-calib", ["--board", "6x8", "--square", 0.0325]),
                                 ("camera", "chessboard", ["--board", "9x6", "--square", 0.025])):
        files = sorted((o.data / name).glob("*.jpg"))
        j, _, cpu = tool(o, command, *files, *board, "-o", folder / f"{name}.yaml")
        print(f"{name}: {j['rms_px']:.3f} px with {len(j['used'])} of {len(files)} photographs, held out {j['held_out_rms_px']:.3f} "
              f"({j['held_out_rms_px'] / j['rms_px']:.2f} times); {j['verdict']}; {cpu:.1f} s of processor", flush=True)
        for d in j["dropped"]:
            print(f"    {d['file']}: {d['why']}")
    church(o, folder)
    chart = o.data / "colorchecker"
    j, _, _ = tool(o, "colour", chart / "d2_colorChecker30cm_d3_wb.tif", "--reference", chart / "spectra_averaged.csv",
                   "-o", folder / "colour.toml")
    print(f"colour chart: Delta E 2000 of patches left out in turn {j['delta_e_held_out']:.2f}, before {j['delta_e_before']:.2f}; "
          f"{j['model']}; {j['verdict']}")
    simulated_chart(o, folder)
    office(o, folder)


def church(o, folder):
    os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"
    import cv2
    data = o.data / "exposures-memorial"
    published = cv2.imread(str(data / "memorial.hdr"), -1) @ [0.0722, 0.7152, 0.2126]
    for step in (1, 2):
        files = [data / f"memorial{61 + k:04}.png" for k in range(0, 16, step)]
        bracket = [*files, "--exposure-list", data / "image_list.txt", "--ignore", "0,0,255", "--force"]
        r, _, _ = tool(o, "response", *bracket, "-o", folder / "response.txt")
        tool(o, "merge", *bracket, "--response", folder / "response.txt", "-o", folder / "church.exr")
        merged = cv2.imread(str(folder / "church.exr"), -1) @ [0.0722, 0.7152, 0.2126]
        curve = np.loadtxt(folder / "response.txt")
        lit = (merged > 0) & (published > 0)
        print(f"church, {len(files)} exposures: log luminance correlates with the published map by "
              f"{np.corrcoef(np.log(merged[lit]), np.log(published[lit]))[0, 1]:.4f}; response "
              f"{'rises throughout' if (np.diff(curve, axis=0) >= 0).all() else 'FALLS'}; {r['verdict']}", flush=True)


def simulated_chart(o, folder):
    """Photographs of 16 bits: each patch off by 1 %."""
    errors = []
    for seed in range(20):
        random = np.random.default_rng(seed)
        rgb = chart_light(chart_codes() * random.normal(1, 0.01, (24, 3)))
        (folder / "chart.ppm").write_bytes(b"P6\n640 480\n65535\n" + np.round(65535 * rgb).astype(">u2").tobytes())
        j, _, _ = tool(o, "colour", folder / "chart.ppm", "-o", folder / "colour.toml", "--force")
        errors.append(j["delta_e_held_out"])
    print(f"simulated linear chart, patches off by 1 %, 20 times: Delta E 2000 held out {np.mean(errors):.2f} (mean), "
          f"{max(errors):.2f} (worst)", flush=True)


def office(o, folder):
    """Nine photographs of a calibrated fish-eye; its lens, fall-off and factor are those of its own calibration."""
    data = o.data / "fisheye-office"
    radius, centre = 3612 / 2, (1019 + 3612 / 2, 3744 - 74 - 3612 / 2)
    f = radius / (2 * math.sin(93 / 2 * DEGREE))
    # r = 2 f sin(t / 2) as a series in t.
    (folder / "office.yaml").write_text(
        f"image_width: 5616\nimage_height: 3744\ncamera_matrix: {{rows: 3, cols: 3, data: [{f}, 0, {centre[0]}, 0, {f}, {centre[1]}, 0, 0, 1]}}\n"
        f"distortion_model: equidistant\ndistortion_coefficients: {{rows: 1, cols: 4, data: [{-1 / 24}, {1 / 1920}, {-1 / 322560}, {1 / 92897280}]}}\n"
        "max_theta_deg: 90\n")
    t = np.linspace(0.01, math.pi / 2, 200)
    r = np.sin(t / 2) / math.sin(93 / 2 * DEGREE)
    fall_off = np.linalg.lstsq(np.stack([t ** 2, t ** 4, t ** 6], 1), 0.1755458928191 * r ** 2 - 0.528613562104476 * r ** 4, rcond=None)[0]
    (folder / "fall-off.txt").write_text("coefficients " + " ".join(map(str, fall_off)) + "\n")
    files = sorted(data.glob("*.JPG"))
    tool(o, "response", *files, "-o", folder / "own.txt")
    for name in (data / "Response_function.rsp", folder / "own.txt"):
        j, _, _ = tool(o, "merge", *files, "--response", name, "--lens", folder / "office.yaml", "--vignette", folder / "fall-off.txt",
                       "--scale", 1.18, "-o", folder / "office.exr", "--force")
        print(f"office, {name.name}: {j['illuminance_lx']:.0f} lx at the lens; {j['verdict']}", flush=True)
