"""A simulated sky with a sun and moving clouds, served as a camera that cycles exposures: how far the irradiance that
daylit-run has of it is from that of each picture. Part "brackets" of scripts/measure-live."""
import json, math, time

WIDTH, HEIGHT, PICTURES = 512, 496, 24
FOCAL = HEIGHT / 2 / math.radians(95)  # equidistant, 190 degrees
SUN = (300.4, 190.7)  # pixel; moves 3 pixels to and fro
EXPOSURES, SHORTEST_HOLDS = (10, 640, 40960), 1.25  # of the brightest pixel
SUN_IRRADIANCE, SUN_BLUR_PX = 12.0, 0.8  # facing it, beside about 5 of sky and clouds; lens's point spread


def pixel_geometry():
    """cos Z and the integral of cos Z over the pixel, steradians: dOmega = sin Z / (Z f^2) of an equidistant lens."""
    rows = []
    for y in range(HEIGHT):
        row = []
        for x in range(WIDTH):
            z = math.hypot(x - (WIDTH - 1) / 2, y - (HEIGHT - 1) / 2) / FOCAL
            row.append(0.0 if z >= math.pi / 2 else (math.sin(z) / z if z > 0 else 1.0) * math.cos(z) / FOCAL**2)
        rows.append(row)
    return rows


def rgbe(r, g, b):
    largest = max(r, g, b)
    if largest < 1e-30:
        return b"\0\0\0\0"
    mantissa, exponent = math.frexp(largest)
    scale = mantissa * 256 / largest
    return bytes((int(r * scale), int(g * scale), int(b * scale), exponent + 128))


def value_of(pixel):
    scale = math.ldexp(1.0, pixel[3] - 136) if pixel[3] else 0.0
    return tuple((c + 0.5) * scale if pixel[3] else 0.0 for c in pixel[:3])


def picture(k, projected, clouds_cross_sun):
    """Radiance Hdr of moment k, without runs. Returns its bytes, horizontal irradiance and brightest value."""
    turn = 2 * math.pi * k / PICTURES
    sun_x, sun_y = SUN[0] + 3 * math.sin(turn), SUN[1] + 1.5 * math.cos(turn)
    covered = clouds_cross_sun and PICTURES * 2 // 3 <= k < PICTURES - 2
    spread = 2 * math.pi * SUN_BLUR_PX**2
    peak = (1e-3 if covered else 1.0) * SUN_IRRADIANCE / spread * FOCAL**2
    bytes_of, sums, brightest = [], [0.0, 0.0, 0.0], 0.0
    drift = 2.5 * math.sin(turn)  # pixels; 0.65 a frame at most, ten times as fast as clouds move at 30 frames a second
    along = [[math.sin(a * (x - drift) + p) for x in range(WIDTH)] for a, p in ((0.05, 0), (0.09, 1))]
    for y in range(HEIGHT):
        down = (math.cos(0.04 * (y - drift)), math.cos(0.07 * y))
        near_sun = abs(y - sun_y) < 8
        for x in range(WIDTH):
            if projected[y][x] == 0.0:
                bytes_of.append(b"\0\0\0\0")
                continue
            cloud = min(max(0.5 * (along[0][x] + along[1][x] * down[1] + down[0]), 0.0), 1.0)
            r, g, b = 0.5 + 1.9 * cloud, 0.8 + 1.6 * cloud, 1.4 + 1.1 * cloud
            if near_sun and abs(x - sun_x) < 8:
                sun = peak * math.exp(-0.5 * ((x - sun_x) ** 2 + (y - sun_y) ** 2) / SUN_BLUR_PX**2)
                r, g, b = r + sun, g + sun, b + sun
            pixel = rgbe(r, g, b)
            value = value_of(pixel)
            bytes_of.append(pixel)
            brightest = max(brightest, *value)
            for c in range(3):
                sums[c] += value[c] * projected[y][x]
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {HEIGHT} +X {WIDTH}\n".encode()
    return header + b"".join(bytes_of), sums, brightest


def make_skies(folder, clouds_cross_sun):
    """Pictures and what is true of them, made once."""
    facts = folder / "facts.json"
    if facts.exists():
        return json.loads(facts.read_text())
    folder.mkdir(parents=True, exist_ok=True)
    projected = pixel_geometry()
    irradiances, brightest = [], 0.0
    for k in range(PICTURES):
        data, irradiance, high = picture(k, projected, clouds_cross_sun)
        (folder / f"sky-{k:02}.hdr").write_bytes(data)
        irradiances.append(irradiance)
        brightest = max(brightest, high)
    facts.write_text(json.dumps({"irradiance": irradiances, "brightest": brightest}))
    return json.loads(facts.read_text())


def lens_file(path):
    path.write_text(f"image_width: {WIDTH}\nimage_height: {HEIGHT}\ncamera_name: sky\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
                    f"  data: [{FOCAL}, 0, {(WIDTH - 1) / 2}, 0, {FOCAL}, {(HEIGHT - 1) / 2}, 0, 0, 1]\n"
                    "distortion_model: equidistant\ndistortion_coefficients:\n  rows: 1\n  cols: 4\n  data: [0, 0, 0, 0]\n"
                    "max_theta_deg: 95\nworld_from_camera: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n")


def luminance(rgb):
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]


def watch(read_status, says, truth, shortest_us, seconds):
    """Every sky that a picture was drawn under, beside the truth at its time: worst and mean relative error."""
    seen = {}
    end = time.time() + seconds
    while time.time() < end:
        last = read_status()["last"]
        if last["sky_id"] and last["drawn"]:
            seen[last["sky_id"]] = last
        time.sleep(0.02)
    shown = {line["frame"]: line for line in map(json.loads, says.read_text().splitlines()[:-1])}
    errors, bounds = [], []
    for frame, last in seen.items():
        true = luminance(truth["irradiance"][shown[frame]["picture"]])  # the camera is mono
        low, most = luminance(last["sky_irradiance"]), last["sky_irradiance_at_most"]
        high = luminance(most) if most else math.inf
        errors.append(abs(low / true - 1))
        bounds.append(low <= 1.02 * true and high >= true)
        if shown[frame]["exposure_us"] != shortest_us:
            raise SystemExit(f"frame {frame} was taken to be the shortest exposure and had {shown[frame]['exposure_us']} us")
    return {"skies": len(errors), "mean": sum(errors) / max(len(errors), 1), "worst": max(errors, default=math.nan),
            "within_bounds": all(bounds), "last": last}
