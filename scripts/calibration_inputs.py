"""What the parts of scripts/measure-calibration share: programs run, and inputs made for them."""
import json, math, pathlib, re, resource, struct, subprocess, time, zlib

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
DEGREE = math.pi / 180

FISHEYE = """image_width: 1280
image_height: 1120
camera_matrix: {rows: 3, cols: 3, data: [321.5, 0, 633.7, 0, 321.1, 566.2, 0, 0, 1]}
distortion_model: equidistant
distortion_coefficients: {rows: 1, cols: 4, data: [-0.012, 0.006, -0.003, 0.0005]}
max_theta_deg: 95
"""


def run(*command, text=None, good=(0,)):
    """stdout, wall-clock and processor seconds of a program."""
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.time()
    done = subprocess.run([str(c) for c in command], input=text, text=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in good:
        raise SystemExit(f"{command}\n{done.stderr}")
    return done.stdout, time.time() - begun, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def tool(o, *arguments):
    """The JSON line of daylit-calibrate, and its times."""
    out, wall, cpu = run(o.bin / "daylit-calibrate", *arguments, "--json", good=(0, 1))
    return json.loads(out.splitlines()[0]), wall, cpu


def write_png(path, grey):
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    height, width = grey.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), grey], axis=1).tobytes()
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def checkerboard(path, columns, rows, stretch=1.0):
    """A print with so many inner corners and a white margin of a square; `stretch`: its squares are not square."""
    y, x = np.mgrid[0:rows + 3, 0:columns + 3]
    black = ((x + y) % 2 == 0) & (x > 0) & (y > 0) & (x < columns + 2) & (y < rows + 2)
    squares = np.where(black, 0, 255).astype(np.uint8)
    write_png(path, np.kron(squares, np.ones((60, round(60 * stretch)), np.uint8)))


def write_hdr(path, light):
    """Grey light as a Radiance picture."""
    mantissa, exponent = np.frexp(light)
    rgbe = np.stack([*[np.clip(mantissa * 256, 0, 255)] * 3, exponent + 128], 2).astype(np.uint8)
    rgbe[light <= 0] = 0
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % light.shape + rgbe.tobytes())


def chart_codes():
    """What a linear camera gives for the 24 patches: its channels overlap."""
    source = (ROOT / "calibration/colour_science.cpp").read_text()
    codes = np.array([[int(v) for v in m] for m in re.findall(r"\{(\d+), (\d+), (\d+)\}", source)[:24]]) / 255
    light = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    return 0.9 * light @ np.array([[.5, .16, .04], [.32, .56, .2], [.06, .2, .55]])


def chart_light(codes):
    """A photograph of these patches on black, before a grey wall."""
    y, x = np.mgrid[0:480, 0:640]
    u, v = (x - 80) / 80, (y - 80) / 80
    patch = (u >= 0) & (u < 6) & (v >= 0) & (v < 4) & (np.maximum(abs(u % 1 - .5), abs(v % 1 - .5)) < .42)
    frame = (u > -.2) & (u < 6.2) & (v > -.2) & (v < 4.2)
    rgb = np.where(frame, .03, .3)[..., None].repeat(3, -1)
    rgb[patch] = codes[(6 * v.astype(int) + u.astype(int))[patch]]
    return rgb
