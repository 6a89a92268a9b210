"""Parts of measure-calibration that measure rooms: reflectances from photographs, and a picture drawn by daylit-run from
nothing but calibrated files beside the picture from the true ones."""
import json, math, pathlib, re, struct, subprocess, zlib

import numpy as np

GUESS = 0.5  # reflectance that the model has before calibration


def run(o, program, *arguments, cwd=None, good=(0,)):
    done = subprocess.run([str(o.bin.resolve() / program), *map(str, arguments)], text=True, capture_output=True, cwd=cwd)
    if done.returncode not in good:
        raise SystemExit(f"{program} {arguments}\n{done.stderr}{done.stdout}")
    return done.stdout


def calibrated(o, folder, *arguments):
    """The JSON line of daylit-calibrate."""
    return json.loads(run(o, "daylit-calibrate", *arguments, "--json", "--force", cwd=folder, good=(0, 1)).splitlines()[0])


# ---- rooms as quadrilaterals of a material

def block(x0, y0, z0, x1, y1, z1):
    """Top and sides; the underside where there is air below."""
    foot = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    faces = [[(*p, z1) for p in foot]]
    faces += [[(*foot[k], z0), (*foot[(k + 1) % 4], z0), (*foot[(k + 1) % 4], z1), (*foot[k], z1)] for k in range(4)]
    return faces + ([[(*p, z0) for p in reversed(foot)]] if z0 > 0 else [])


def wall_with_window(x, y, z, window_y, window_z):
    """Nine fields of the wall at x between y[0] and y[1]; the middle one is the window."""
    ys, zs = (y[0], *window_y, y[1]), (0, *window_z, z)
    field = lambda i, k: [(x, ys[i], zs[k]), (x, ys[i + 1], zs[k]), (x, ys[i + 1], zs[k + 1]), (x, ys[i], zs[k + 1])]
    return [field(i, k) for i in range(3) for k in range(3) if (i, k) != (1, 1)], field(1, 1)


def sunny_office():
    x, y, z = 5, 4, 2.7
    fields, window = wall_with_window(0, (0, y), z, (1.0, 3.0), (0.9, 2.2))
    faces = [("floor", [(0, 0, 0), (x, 0, 0), (x, y, 0), (0, y, 0)]), ("ceiling", [(0, 0, z), (0, y, z), (x, y, z), (x, 0, z)]),
             ("wall", [(0, 0, 0), (0, 0, z), (x, 0, z), (x, 0, 0)]), ("wall", [(0, y, 0), (x, y, 0), (x, y, z), (0, y, z)]),
             ("accent", [(x, 0, 0), (x, 0, z), (x, y, z), (x, y, 0)]), *(("wall", f) for f in fields), ("window", window)]
    faces += [("wood", f) for f in block(2.0, 2.6, 0.7, 3.4, 3.4, 0.74)]
    for a, b in ((2.05, 2.65), (3.3, 2.65), (2.05, 3.3), (3.3, 3.3)):
        faces += [("wood", f) for f in block(a, b, 0, a + .05, b + .05, .7)]
    faces += [("cupboard", f) for f in block(3.2, 0.0, 0, 4.4, 0.5, 1.8)] + [("bin", f) for f in block(1.2, .3, 0, 1.45, .55, .3)]
    truth = {"floor": (.32, .24, .17), "ceiling": (.82, .82, .8), "wall": (.72, .7, .64), "accent": (.15, .35, .5),
             "wood": (.45, .3, .18), "cupboard": (.6, .62, .6), "bin": (.1, .4, .12)}
    sky = 'model = "clear"\nzenith_radiance = [14, 18, 26]\nsun = { azimuth = 195, elevation = 35, normal_irradiance = [800, 730, 620] }'
    return faces, truth, sky, [(.5, 3.5, 1.6, 4, .5, .8), (4.6, .9, 1.6, 1, 3, .7), (.6, .6, 1.5, 3.5, 3.2, 1.2)]


def l_shape_under_clouds():
    z, p = 2.5, [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)]
    fields, window = wall_with_window(6, (0, 2.5), z, (.5, 2.0), (.8, 2.1))
    faces = [(m, [(*c, h) for c in corners]) for m, h in (("carpet", 0), ("ceiling", z))
             for corners in ([p[0], p[1], p[2], (0, 2.5)], [(0, 2.5), p[3], p[4], p[5]])]
    for k, m in ((0, "brick"), (2, "paint"), (3, "paint"), (4, "paint"), (5, "yellow")):
        a, b = p[k], p[(k + 1) % 6]
        faces.append((m, [(*a, 0), (*b, 0), (*b, z), (*a, z)]))
    faces += [*(("paint", f) for f in fields), ("window", window)]
    faces += [("sofa", f) for f in block(.3, 3.6, 0, 1.2, 4.9, .7)] + [("shelf", f) for f in block(3.2, 0, 0, 4.2, .35, 1.9)]
    truth = {"carpet": (.12, .1, .2), "ceiling": (.85, .85, .85), "brick": (.4, .16, .1), "paint": (.75, .75, .7),
             "yellow": (.7, .55, .1), "sofa": (.05, .06, .08), "shelf": (.65, .6, .5)}
    return faces, truth, 'model = "overcast"\nzenith_radiance = [50, 52, 55]', [
        (5.5, 2.1, 1.6, 0, .6, 1.0), (.3, .4, 1.6, 2.4, 4.6, .8), (2.6, 4.6, 1.5, 3.8, .2, .9)]


def white_room_with_tiles():
    x, y, z = 4, 6, 3
    faces = [("ceiling", [(0, 0, z), (0, y, z), (x, y, z), (x, 0, z)]), ("wall", [(0, 0, 0), (0, 0, z), (x, 0, z), (x, 0, 0)]),
             ("wall", [(0, y, 0), (x, y, 0), (x, y, z), (0, y, z)]), ("wall", [(x, 0, 0), (x, 0, z), (x, y, z), (x, y, 0)])]
    for i in range(16):
        for k in range(24):
            faces.append((f"floor {(i + k) % 2}", [(a / 4, b / 4, 0) for a, b in ((i, k), (i + 1, k), (i + 1, k + 1), (i, k + 1))]))
    for side, window_y in (((0, 3), (.6, 2.4)), ((3, 6), (3.6, 5.4))):
        fields, window = wall_with_window(0, side, z, window_y, (.8, 2.3))
        faces += [*(("wall", f) for f in fields), ("window", window)]
    faces += [("desk", f) for f in block(2.6, 1, 0, 3.6, 2.6, .75)] + [("door", f) for f in block(1.2, 5.92, 0, 2.1, 6, 2.1)]
    truth = {"ceiling": (.9, .9, .9), "wall": (.85, .84, .8), "floor 0": (.15, .14, .13), "floor 1": (.75, .72, .7),
             "desk": (.5, .35, .22), "door": (.3, .33, .3)}
    sky = 'model = "clear"\nzenith_radiance = [14, 18, 26]\nsun = { azimuth = 170, elevation = 50, normal_irradiance = [800, 730, 620] }'
    return faces, truth, sky, [(3.6, .4, 1.6, .8, 5, .6), (.4, 5.6, 1.6, 3.4, 1.2, .7), (3.5, 5.5, 1.6, .3, 1, 1.4)]


def write_room(path, faces, reflectance):
    """A pattern of materials "name 0", "name 1" is one material in a model that does not tell them apart."""
    pane = "newmtl window\nKd 0 0 0\nTf 0.85 0.88 0.86\n"
    path.with_suffix(".mtl").write_text(pane + "".join(f"newmtl {m}\nKd {r} {g} {b}\n" for m, (r, g, b) in reflectance.items()))
    text = f"mtllib {path.stem}.mtl\n"
    for material, corners in faces:
        name = material if material in reflectance or material == "window" else material.split()[0]
        text += f"usemtl {name}\n" + "".join("v %.6g %.6g %.6g\n" % c for c in corners)
        text += "f " + " ".join(str(k - len(corners)) for k in range(len(corners))) + "\n"
    path.write_text(text)


def photographs(o, folder, room, sky, cameras, size=(320, 240), fov=62, samples=256):
    """Renders the room from each camera with 1 % noise; the configurations name guess.obj."""
    (folder / "cube.obj").write_text("v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    eye, target = cameras[0][:3], cameras[0][3:]
    (folder / "shots.toml").write_text(f"""[sky]
{sky}
ground_albedo = 0.2
[interior]
fov = {fov}
[simulate]
samples = {samples}
sensor_noise = 0.01
marker_board = false
[path]
camera = {[list(c) for c in cameras]}
[pose]
position = {list(eye)}
look_at = {list(target)}
[room]
model = "{room}"
[[object]]
model = "cube.obj"
position = [{2 * eye[0] - target[0]}, {2 * eye[1] - target[1]}, 0]
[output]
size = {list(size)}
""")
    run(o, "daylit-simulate", "shots.toml", "-o", "shots", "--frames", len(cameras), "--quiet", cwd=folder)
    names = []
    for k in range(len(cameras)):
        text = (folder / ("shots/CONFIG.toml" if k == 0 else f"shots/CONFIG_{k:04d}.toml")).read_text()
        text = re.sub(r'(?m)^volume.*\n', "", text).replace(f"../{room}", "../guess.obj")
        text = re.sub(r"sky_\d+\.", "sky.", text)  # one sky: nothing moved
        (folder / f"shots/{k}.toml").write_text(text)
        names.append(f"shots/{k}.toml")
    return names


def materials(o, folder):
    """Three rooms, three photographs each: the error of every reflectance."""
    for make in (sunny_office, l_shape_under_clouds, white_room_with_tiles):
        room = folder / make.__name__
        room.mkdir()
        faces, truth, sky, cameras = make()
        write_room(room / "room.obj", faces, truth)
        mean = {}
        for name in truth:
            mean.setdefault(name.split()[0], []).append(truth[name])
        mean = {name: np.mean(values, axis=0) for name, values in mean.items()}
        write_room(room / "guess.obj", faces, {name: (GUESS,) * 3 for name in mean})
        j = calibrated(o, room, "materials", *photographs(o, room, "room.obj", sky, cameras), "-o", "found.obj")
        print(f"{make.__name__.replace('_', ' ')}: {j['verdict']}, {'; '.join(j['why'])}")
        for m in j["materials"]:
            error = 100 * (np.array(m["reflectance"]) / mean[m["name"]] - 1)
            stated = 100 * np.array(m["uncertainty"]) / np.array(m["reflectance"])
            print(f"    {m['name']:10} {100 * m['coverage']:5.1f} % of a picture: off by {abs(error).max():4.2f} %, "
                  f"stated {stated.max():4.2f} %" + ("" if m["seen"] else ", not seen"))


# ---- from boards to a picture

def png(path, grey):
    """8-bit grey picture as PNG."""
    h, w = grey.shape
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = np.concatenate([np.zeros((h, 1), np.uint8), grey], axis=1).tobytes()
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", w, h, 8, 0, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


class Lens:
    """Ideal pinhole or equidistant lens of a lens file without distortion."""

    def __init__(self, path):
        text = path.read_text()
        number = lambda key: int(re.search(key + r":\s*(\d+)", text)[1])
        self.width, self.height, self.fisheye = number("image_width"), number("image_height"), "equidistant" in text
        k = [float(v) for v in re.search(r"camera_matrix:.*?data:\s*\[([^\]]*)\]", text, re.S)[1].split(",")]
        self.f, self.c = k[0], np.array([k[2], k[5]])
        turn = re.search(r"world_from_camera:[^\[]*\[([^\]]*)\]", text, re.S)
        self.world_from_camera = np.array([float(v) for v in turn[1].split(",")]).reshape(3, 3) if turn else np.eye(3)

    def rays(self, step=(0, 0)):
        y, x = np.mgrid[0:self.height, 0:self.width]
        p = (np.stack([x + step[0], y + step[1]], axis=-1) - self.c) / self.f
        if not self.fisheye:
            return np.concatenate([p, np.ones((*p.shape[:2], 1))], axis=-1)
        r = np.linalg.norm(p, axis=-1, keepdims=True) + 1e-12
        return np.concatenate([np.sin(r) * p / r, np.cos(r)], axis=-1)

    def pixel(self, d):
        if not self.fisheye:
            return self.c + self.f * d[:2] / d[2]
        r = math.hypot(d[0], d[1])
        return self.c + self.f * math.atan2(r, d[2]) / r * d[:2]


def rotation(axis, angle):
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def checkerboard(lens, turn, at, columns, rows, square, random):
    """8-bit sRGB picture of a board with so many inner corners, its middle `at` metres before the camera."""
    light = 0
    for step in [(a, b) for a in (-.33, 0, .33) for b in (-.33, 0, .33)]:
        d = lens.rays(step)
        s = turn[:, 2] @ at / (d @ turn[:, 2])
        p = (s[..., None] * d - at) @ turn / square + [(columns + 1) / 2, (rows + 1) / 2, 0]
        inside = (p[..., 0] > 0) & (p[..., 0] < columns + 1) & (p[..., 1] > 0) & (p[..., 1] < rows + 1) & (s > 0)
        paper = (p[..., 0] > -1) & (p[..., 0] < columns + 2) & (p[..., 1] > -1) & (p[..., 1] < rows + 2) & (s > 0)
        black = inside & ((np.floor(p[..., 0]) + np.floor(p[..., 1])) % 2 == 0)
        light = light + np.where(black, .04, np.where(paper, .75, .2)) / 9
    light = np.clip(light * (1 + .01 * random.standard_normal(light.shape)), 0, 1)
    return np.round(255 * np.where(light < .0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - .055)).astype(np.uint8)


def board_photographs(folder, lens, random):
    """Fourteen views all over the field, each tilted another way."""
    folder.mkdir()
    names = []
    for k in range(14):
        theta = (math.radians((0, 35, 60)[k % 3] + 12 * (k % 2)) if lens.fisheye else 0.45 * (k % 3) * lens.width / 2 / lens.f / 1.5)
        phi, tilt = 2.4 * k, math.radians(22 + 3 * (k % 5))
        distance = .42 if lens.fisheye else .36 * lens.f / (.62 * lens.width)
        look = rotation((0, 0, 1), phi) @ rotation((0, 1, 0), theta) @ rotation((0, 0, 1), -phi)
        turn = look @ rotation((math.cos(1.7 * k), math.sin(1.7 * k), 0), tilt) @ rotation((0, 0, 1), .3 * (k % 4))
        png(folder / f"{k}.png", checkerboard(lens, turn, look @ [0, 0, distance], 9, 6, .036, random))
        names.append(f"{folder.name}/{k}.png")
    return names


def landmarks(folder, lens, random):
    """Twelve corners of houses seen from (0, 0, 1), clicked to a whole pixel."""
    lines = []
    while len(lines) < 12:
        d = random.standard_normal(3)
        d /= np.linalg.norm(d)
        seen = lens.world_from_camera.T @ d
        if seen[2] > .05:
            x, y = np.round(lens.pixel(seen))
            lines.append("%d %d %.4f %.4f %.4f" % (x, y, *(np.array([0, 0, 1]) + 12 * d)))
    (folder / "landmarks.txt").write_text("\n".join(lines) + "\n")


def object_error(o, folder, config):
    """daylit-run of a configuration, and how far its object is from the truth."""
    run(o, "daylit-run", config, "--quiet", "--force", cwd=folder)
    return json.loads(run(o, "daylit-simulate", "compare", ".", "--json", cwd=folder).splitlines()[0])


def end_to_end(o, folder):
    """The demo's room: lenses from boards, orientation from clicked points, pose from the marker, reflectances from three
    photographs; then daylit-run with these files, and with the true ones."""
    for scene in ("overcast", "sun"):
        work = folder / scene
        work.mkdir()
        random = np.random.default_rng(1)
        run(o, "daylit-simulate", "--demo", scene, "-o", ".", "--quiet", "--spp", 256, "--size", "512,496", cwd=work)
        scene_text, config = (work / "scene.toml").read_text(), (work / "CONFIG.toml").read_text()
        faces = re.sub("mtllib .*", "mtllib guess.mtl", (work / "room.obj").read_text())
        (work / "guess.obj").write_text(faces)
        names = re.findall(r"newmtl (\S+)", (work / "room.mtl").read_text())
        (work / "guess.mtl").write_text("".join(f"newmtl {n}\nKd {GUESS} {GUESS} {GUESS}\n" for n in names))
        run(o, "daylit-precompute", "room.obj", "-o", "room.volume", "--quiet", cwd=work)
        truth = object_error(o, work, "CONFIG.toml")

        boards = ["--board", "9x6", "--square", "0.036"]
        inside, outside = Lens(work / "interior.yaml"), Lens(work / "sky.yaml")
        a = calibrated(o, work, "camera", *board_photographs(work / "inside", inside, random), *boards, "-o", "camera.yaml")
        b = calibrated(o, work, "fisheye", *board_photographs(work / "outside", outside, random), *boards, "-o", "fisheye.yaml")
        landmarks(work, outside, random)
        c = calibrated(o, work, "align", "sky.exr", "--lens", "fisheye.yaml", "--landmarks", "landmarks.txt", "--position",
                       "0,0,1", "-o", "sky-camera.yaml")
        sky = re.search(r"\[sky\]\n(.*?)\n\n", scene_text, re.S)[1].replace("ground_albedo = 0.2", "")
        cameras = [(.3, 2.5, 1.7, 2.4, .3, .5), (2.3, 2.5, 1.7, .2, .5, .6), (.4, .3, 1.8, 2.5, 2.3, .6)]
        d = calibrated(o, work, "materials", *photographs(o, work, "room.obj", sky.strip(), cameras), "-o", "found.obj")
        run(o, "daylit-precompute", "found.obj", "-o", "found.volume", "--quiet", cwd=work)
        marker = re.search(r"\[marker\].*?\n\n", scene_text, re.S)[0]
        tracked = re.sub(r"\[pose\].*?\n\n", lambda _: marker, config, flags=re.S)
        (work / "tracked.toml").write_text(tracked)
        for true, found in (("sky.yaml", "sky-camera.yaml"), ("interior.yaml", "camera.yaml"), ("room.obj", "found.obj"),
                            ("room.volume", "found.volume")):
            tracked = tracked.replace(f'"{true}"', f'"{found}"')
        (work / "calibrated.toml").write_text(tracked)
        tools = ", ".join(f"{name} {j['verdict']}" for name, j in zip(("camera", "fisheye", "align", "materials"), (a, b, c, d)))
        print(f"{scene}: {tools}; orientation known to {c['sigma_deg']:.2f} degrees")
        rows = {"true files, true pose": truth, "true files, pose from the marker": object_error(o, work, "tracked.toml"),
                "calibrated files, pose from the marker": object_error(o, work, "calibrated.toml")}
        for name, j in rows.items():
            print(f"    {name}: {j}")


PARTS = {"materials": materials, "end-to-end": end_to_end}
