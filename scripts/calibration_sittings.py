"""Sittings and days of known truth. Parts "sittings" and "days" of scripts/measure-calibration."""
import json, math, re

import cv2
import numpy as np

from calibration_inputs import DEGREE, FISHEYE, checkerboard, run, tool, write_hdr


def lens_numbers(path):
    """fx, cx, fy, cy and distortion of a lens file."""
    text = path.read_text()
    m = [float(v) for v in re.search(r"camera_matrix:.*?data: *\[(.*?)\]", text, re.S)[1].split(",")]
    k = [float(v) for v in re.search(r"distortion_coefficients:.*?data: *\[(.*?)\]", text, re.S)[1].split(",")]
    return (m[0], m[2], m[4], m[5]), k


def fisheye_directions(lens, pixels):
    """Kannala-Brandt: t (1 + k1 t^2 + ...) by Newton's method."""
    (fx, cx, fy, cy), k = lens
    p = (pixels - [cx, cy]) / [fx, fy]
    r = np.linalg.norm(p, axis=1)
    t = r.copy()
    for _ in range(20):
        value = t * (1 + sum(c * t ** (2 * n + 2) for n, c in enumerate(k)))
        t -= (value - r) / (1 + sum((2 * n + 3) * c * t ** (2 * n + 2) for n, c in enumerate(k)))
    return np.stack([*(p / r[:, None] * np.sin(t)[:, None]).T, np.cos(t)], 1)


def angle_error(found, truth, circle, part):
    """Largest angle between two lenses inside a part of the circle, degrees, apart from a turn of the camera."""
    radius, phi = np.meshgrid(np.arange(0.01, part, 0.02) * circle["radius"], np.arange(48) * math.pi / 24)
    pixels = np.stack([circle["x"] + radius * np.cos(phi), circle["y"] + radius * np.sin(phi)], 2).reshape(-1, 2)
    a, b = fisheye_directions(found, pixels), fisheye_directions(truth, pixels)
    u, _, v = np.linalg.svd(a.T @ b)
    return 2 * np.arcsin(np.linalg.norm(a - b @ (u @ v).T, axis=1).max() / 2) / DEGREE


def corners_seen(lens, pose, stretch):
    """Pixels of the 12 x 9 inner corners of a print of checkerboard()."""
    (fx, cx, fy, cy), k = lens
    j, i = np.mgrid[0:9, 0:12] + 2.0
    d = (np.array(pose["corner_m"]) + 0.025 * i.ravel()[:, None] * pose["x"] + 0.025 / stretch * j.ravel()[:, None] * pose["y"])
    across = np.linalg.norm(d[:, :2], axis=1)
    t = np.arctan2(across, d[:, 2])
    r = t * (1 + sum(c * t ** (2 * n + 2) for n, c in enumerate(k))) / across
    return np.stack([cx + fx * r * d[:, 0], cy + fy * r * d[:, 1]], 1)


def move_corners(path, corners, random):
    """Moves what is around each corner by 0.2 pixels (standard deviation in x and in y)."""
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    y, x = np.mgrid[0:picture.shape[0], 0:picture.shape[1]].astype(np.float32)
    for at, move in zip(corners, random.normal(0, 0.2, corners.shape)):
        half = np.sort(np.abs(corners - at).max(axis=1))[1] / 2
        low, high = np.maximum(np.ceil(at - half), 0).astype(int), np.ceil(at + half).astype(int)
        x[low[1]:high[1], low[0]:high[0]] -= move[0]
        y[low[1]:high[1], low[0]:high[0]] -= move[1]
    cv2.imwrite(str(path), cv2.remap(picture, x, y, cv2.INTER_CUBIC))


def sittings(o, folder):
    """Sittings of a fish-eye: eight photographs of a board and two of another one that is 8 % longer; noise of 0.2 pixels."""
    (folder / "lens.yaml").write_text(FISHEYE)
    truth, good = lens_numbers(folder / "lens.yaml"), 0
    for seed in range(o.sittings):
        random, files = np.random.default_rng(seed), []
        for name, views, stretch in (("good", 8, 1), ("wrong", 2, 1.08)):
            checkerboard(folder / f"{name}.png", 12, 9, stretch)
            run(o.bin / "daylit-simulate", "photographs", folder / f"{name}.png", "--width", 0.375, "--lens", folder / "lens.yaml",
                "-o", folder, "--views", views, "--seed", 100 * seed + views, "--format", "png", "--quiet", "--reach", 0.98, "--part", 0.7)
            for pose in json.loads((folder / "truth.json").read_text()):
                files.append((folder / pose["file"]).rename(folder / f"{name}-{pose['file']}"))
                move_corners(files[-1], corners_seen(truth, pose, stretch), random)
        j, _, _ = tool(o, "fisheye", *files, "--board", "12x9", "--square", 0.025, "-o", folder / "found.yaml", "--force")
        named = sorted(d["file"] for d in j["dropped"])
        error = angle_error(lens_numbers(folder / "found.yaml"), truth, j["circle_px"], 0.85)
        fine = error < 0.05 and named == ["wrong-photograph-00.png", "wrong-photograph-01.png"]
        good += fine
        print(f"sitting {seed}: circle {2 * j['circle_px']['radius']:.0f} px across, corners to {j['reach_deg'] / 95:.2f} of it, "
              f"off by {j['rms_px'] / math.sqrt(2):.2f} px in x and y; angles within {error:.3f} degrees; {j['verdict']}; "
              f"left out: {', '.join(named)}{'' if fine else ' <-- not within 0.05, or not these two'}", flush=True)
    print(f"{good} of {o.sittings} sittings: angles within 0.05 degrees inside 85 % of the radius, both wrong pictures named")


SKY_LENS = """image_width: 512
image_height: 496
camera_matrix: {rows: 3, cols: 3, data: [154.4, 0, 255.5, 0, 154.4, 247.5, 0, 0, 1]}
distortion_model: equidistant
distortion_coefficients: {rows: 1, cols: 4, data: [0, 0, 0, 0]}
max_theta_deg: 95
"""


def sun_direction(latitude, longitude, day, hour):
    """x east, y north, z up; `day` of June 2026, `hour` UTC. Astronomical Almanac, as Michalsky 1988: within 0.01 degrees."""
    n = 9647.5 + (day - 1) + hour / 24  # 2026-06-01 0 h is 9647.5 days after J2000
    mean, anomaly = 280.460 + 0.9856474 * n, (357.528 + 0.9856003 * n) * DEGREE
    longitude_of_sun = (mean + 1.915 * math.sin(anomaly) + 0.020 * math.sin(2 * anomaly)) * DEGREE
    tilt = (23.439 - 4e-7 * n) * DEGREE
    ascension = math.atan2(math.cos(tilt) * math.sin(longitude_of_sun), math.cos(longitude_of_sun))
    declination = math.asin(math.sin(tilt) * math.sin(longitude_of_sun))
    turn = (15 * (6.697375 + 0.0657098242 * n + hour) + longitude) * DEGREE - ascension
    phi = latitude * DEGREE
    return np.array([-math.cos(declination) * math.sin(turn),
                     math.sin(declination) * math.cos(phi) - math.cos(declination) * math.cos(turn) * math.sin(phi),
                     math.sin(declination) * math.sin(phi) + math.cos(declination) * math.cos(turn) * math.cos(phi)])


def sky_with_clouds(sun, covered, random):
    """What the sky camera sees; `sun` in its frame. Before a sun that is covered: a bright cloud."""
    y, x = np.mgrid[0:496, 0:512].astype(float)
    p = np.stack([x - 255.5, y - 247.5], 2) / 154.4
    t = np.maximum(np.linalg.norm(p, axis=2), 1e-9)
    d = np.concatenate([p * (np.sin(t) / t)[..., None], np.cos(t)[..., None]], 2)
    apart, phase = np.linalg.norm(d - sun, axis=2), random.uniform(0, 6.28)
    light = 1 + 1.5 * np.maximum(0, np.sin(5 * d[..., 0] + phase) + np.sin(7 * d[..., 1] + 2 * phase))
    light += (12 if covered else 20) * np.exp(-apart / (0.15 if covered else 0.05))
    if not covered:
        r = math.acos(sun[2]) / math.hypot(sun[0], sun[1]) * 154.4
        light += 1e5 * np.maximum(0, 1 - abs(x - 255.5 - r * sun[0])) * np.maximum(0, 1 - abs(y - 247.5 - r * sun[1]))
    return np.where(t < 95 * DEGREE, light * random.normal(1, 0.01, light.shape), 0)


def days(o, folder):
    """Ten pictures of a day by a camera that looks up, not quite, and is turned: 20 days with sun, 20 with clouds half of the time."""
    (folder / "lens.yaml").write_text(SKY_LENS)
    for clouds in (False, True):
        errors, stated = [], []
        for seed in range(o.sittings):
            random = np.random.default_rng(seed)
            turn, (x, y) = random.uniform(-3, 3), random.uniform(-.3, .3, 2)
            about_z = np.array([[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]])
            u, _, v = np.linalg.svd(np.array([[1, 0, x], [0, 1, y], [-x, -y, 1]]))
            truth = about_z @ u @ v
            times = []
            for k in range(10):
                hour = 8.37 + k
                sun = truth.T @ sun_direction(50.36, 7.6, 3, hour - 1)
                write_hdr(folder / f"{k}.hdr", sky_with_clouds(sun, clouds and k % 2 == 1, random))
                times.append(f"{k}.hdr 2026-06-03 {int(hour):02}:22:12")
            (folder / "times.txt").write_text("\n".join(times) + "\n")
            j, _, _ = tool(o, "align", *[folder / f"{k}.hdr" for k in range(10)], "--lens", folder / "lens.yaml", "--place",
                           "50.36,7.6,1", "--times", folder / "times.txt", "-o", folder / "found.yaml", "--force")
            found = re.search(r"world_from_camera:.*?\[([^\]]*)\]", (folder / "found.yaml").read_text(), re.S)[1]
            found = np.array([float(v) for v in found.split(",")]).reshape(3, 3)
            errors.append(math.degrees(math.acos(min(1, (np.trace(found.T @ truth) - 1) / 2))))
            stated.append(j["sigma_deg"])
        print(f"{o.sittings} days, {'clouds before half of the suns' if clouds else 'sun'}: off by {np.median(errors):.3f} (median), "
              f"{max(errors):.3f} degrees (worst); stated deviation {np.median(stated):.3f}", flush=True)
