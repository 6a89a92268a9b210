"""A camera that walks around the object: pictures of the daemon beside the simulator's truth of the place they were taken at."""
import json, math, re, subprocess

from live_cameras import BIN, Camera, live_config, run, section

FRAMES, PATHS = 16, 512  # places along the scene's [path]; paths a pixel of the truth


def make(folder, scene):
    """What the camera sees from each place, and the truth with the object."""
    if not (folder / f"truth_{FRAMES - 1:04}.exr").exists():
        folder.mkdir(exist_ok=True)
        scene = scene.replace('"room.obj"', '"../room.obj"').replace('"teapot.obj"', '"../teapot.obj"')
        (folder / "scene.toml").write_text(scene)
        run(BIN / "daylit-simulate", folder / "scene.toml", "-o", folder, "--spp", PATHS, "--frames", FRAMES, "--quiet", "--force")


def number(k):
    return f"_{k:04}" if k else ""


def error_of(folder, k, name):
    text = run(BIN / "daylit-simulate", "compare", folder, "--frame", k, "--result", folder / f"{name}.exr", "--result-mask",
               folder / f"{name.replace('-', '-mask-')}.exr", "--json", capture_output=True, text=True).stdout
    return json.loads(text)


def draw_live(folder, marker, sky, room, white, pictures):
    """(place, error) of each of so many pictures, the first ten left out; the daemon's last word on its latency."""
    text = re.sub(r'volume = ".*"', 'volume = "../room.volume"', (folder / "CONFIG.toml").read_text())
    text = live_config(text, marker, (sky, "Mono16", 1000, 30), (room, "RGB8", 1000, 10), white)
    (folder / "live.toml").write_text(text + '\n[output]\nexr = "live.exr"\nmask = "live-mask.exr"\n')
    walk = list(range(FRAMES)) + list(range(FRAMES - 2, 0, -1))
    views = [folder / f"interior{number(k)}.exr" for k in walk]
    says = folder / "frames.jsonl"
    cameras = [Camera([folder / "sky.exr"], sky, "--white", white, "--mosaic", "rggb"),
               Camera(views, room, "--white", 1.0, "--response", "srgb", says=says)]
    for camera in cameras:
        camera.plug()
    lines = run(BIN / "daylit-run", folder / "live.toml", "--frames", pictures, "--json", stdout=subprocess.PIPE, text=True).stdout
    for camera in cameras:
        camera.unplug()
    served = {line["frame"]: walk[line["picture"]] for line in map(json.loads, filter(lambda l: l.endswith("}\n"), open(says)))}
    drawn = [json.loads(line) for line in lines.splitlines()]
    return [(served[d["interior_id"]], error_of(folder, served[d["interior_id"]], f"live-{d['frame']:05}"))
            for d in drawn[10:] if d["drawn"]], sum(not d["drawn"] for d in drawn)


def draw_once(folder, k):
    """From the files at full precision, with the true pose."""
    text = re.sub(r'volume = ".*"', 'volume = "../room.volume"', (folder / f"CONFIG{number(k)}.toml").read_text())
    text = re.sub(r"^\[output\].*", '[output]\nexr = "once-.exr"\nmask = "once-mask-.exr"\n', text, flags=re.S | re.M)
    (folder / "once.toml").write_text(text)
    run(BIN / "daylit-run", folder / "once.toml", "--force", "--quiet", stderr=subprocess.DEVNULL)
    return error_of(folder, k, "once-")


def rms(errors, part, what="relative_rms"):
    values = [e[part][what] for e in errors if e[part][what] is not None]  # none where no pixel shows that part
    return 100 * math.sqrt(sum(v ** 2 for v in values) / len(values)) if values else math.nan


def measure(folder, scene, sky, room, white, pictures):
    make(folder, scene)
    live, untouched = draw_live(folder, section(scene, "marker"), sky, room, white, pictures)
    once = [draw_once(folder, k) for k in sorted({k for k, _ in live})]
    print("\n| picture | pictures | object, RMS % | truth's own error, % | without it | shadow, RMS % | masks, IoU, least |")
    print("|---|---|---|---|---|---|---|")
    for words, errors in (("once, from the files, true pose", once), ("live, 8 bits, tracked, camera walking", [e for _, e in live])):
        of_all, own = rms(errors, "object"), rms(errors, "object", "truth_standard_error")
        print(f"| {words} | {len(errors)} | {of_all:.2f} | {own:.2f} | {math.sqrt(max(of_all ** 2 - own ** 2, 0)):.2f} | "
              f"{rms(errors, 'shadow'):.2f} | {min(e['mask_iou'] for e in errors):.4f} |")
    print(f"\n{untouched} of {pictures} pictures were left as they were")
