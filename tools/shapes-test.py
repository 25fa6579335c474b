#!/usr/bin/env python3
"""The files of `rowtone shapes` as other programs read them: pyuff the .unv, NumPy the .npz, ffmpeg the .gif.

    tools/shapes-test.py [--rowtone target/release/rowtone]

Simulates a part that bends at one tone and turns at another, measures its shapes once for each file, and looks whether all
files say the same as the JSON, and the JSON what was simulated. Needs numpy, pyuff and ffmpeg.
Exit status 1, and what differed, where anything does.
"""

import argparse, json, os, subprocess, sys, tempfile

import numpy as np
import pyuff

SIZE, FPS, SECONDS, LINE_US, EXPOSURE_US = (160, 96), 60, 2, 150, 200
SCALE_UM = 40.0
MODES = ["131.7:0.1r", "317.3:-0.05r:0.08c"]


def check(what, holds):
    if not holds:
        sys.exit(f"{what}: differs")
    print(f"{what}: right")


def numbers(entries):
    nothing = complex(np.nan, np.nan)
    return np.array([nothing if e is None else complex(*e) for e in entries])


def same(a, b, within):
    return a.shape == b.shape and np.array_equal(np.isnan(a), np.isnan(b)) and np.nanmax(np.abs(a - b)) < within


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rowtone", default="target/release/rowtone")
    rowtone = os.path.abspath(parser.parse_args().rowtone)
    camera = ["--line-time-us", str(LINE_US), "--exposure-us", str(EXPOSURE_US)]
    with tempfile.TemporaryDirectory() as folder:
        clip = os.path.join(folder, "clip.y4m")
        size = f"{SIZE[0]}x{SIZE[1]}"
        modes = [word for mode in MODES for word in ("--mode", mode)]
        subprocess.run([rowtone, "simulate", "--size", size, "--fps", str(FPS), "--seconds", str(SECONDS), "--scene",
                        "speckle", *camera, *modes, "-o", clip], check=True, stderr=subprocess.DEVNULL)

        def shapes(ending, *more):
            out = os.path.join(folder, f"shape{len(os.listdir(folder))}.{ending}")
            said = subprocess.run([rowtone, "shapes", clip, *camera, "--hz", "131.7,317.3", "--format", "json", "-o", out,
                                   *more], check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
            return out, json.loads(said.stdout)

        npz, said = shapes("npz")
        shape = (said[0]["rows"], said[0]["cols"])
        row = (np.arange(shape[0]) * 16 + 7.5) / (SIZE[1] - 1) * 2 - 1
        x = numbers(said[0]["x"]).reshape(shape)
        x *= np.sign((x.real * row[:, None]).sum())
        check("JSON: a bending of 0.1 px", np.abs(x - 0.1 * row[:, None]).max() < 0.01)

        arrays = np.load(npz)
        check("NPZ: arrays", arrays["x"].shape == (2, *shape) and arrays["picture"].shape == SIZE[::-1]
              and arrays["moves"].dtype == bool and int(arrays["tile"]) == 16 and float(arrays["fps"]) == FPS
              and "um_per_px" not in arrays)
        for k, tone in enumerate(said):
            for axis in "xy":
                check(f"NPZ: {axis} at {tone['hz']:.1f} Hz", same(arrays[axis][k].ravel(), numbers(tone[axis]), 1e-6))
            sd = np.array([np.nan if sd is None else sd for sd in tone["sd"]])
            check(f"NPZ: deviations at {tone['hz']:.1f} Hz", same(arrays["sd"][k].ravel(), sd, 1e-6))

        unv, said = shapes("unv", "--um-per-px", str(SCALE_UM))
        file = pyuff.UFF(unv)
        types = file.get_set_types()
        sets = {kind: [file.read_sets(int(at)) for at in np.flatnonzero(types == kind)] for kind in np.unique(types)}
        tiles = shape[0] * shape[1]
        count = {kind: len(found) for kind, found in sets.items()}
        check("UNV: datasets", count == {151: 1, 164: 1, 15: 1, 82: sum(shape), 55: 2, 58: 2 * tiles})
        nodes = sets[15][0]
        metres = SCALE_UM * 1e-6
        check("UNV: nodes", np.allclose(nodes["x"][:2], np.array([7.5, 23.5]) * metres)
              and np.allclose(nodes["y"][-1], (shape[0] * 16 - 8.5) * metres))
        lines = {tuple(int(n) for n in line["nodes"]) for line in sets[82]}
        check("UNV: mesh", tuple(range(1, shape[1] + 1)) in lines and tuple(range(1, tiles + 1, shape[1])) in lines)
        for tone, found in zip(said, sets[55]):
            check(f"UNV: data at nodes, {tone['hz']:.1f} Hz", abs(found["freq"] - tone["hz"]) < 1e-2
                  and np.array_equal(found["node_nums"], np.arange(1, tiles + 1))
                  and same(found["r1"], numbers(tone["x"]) * metres, 1e-9)
                  and same(found["r2"], numbers(tone["y"]) * metres, 1e-9) and not found["r3"].any())
        for found in sets[58]:
            axis = " xy"[found["rsp_dir"]]
            tile = found["rsp_node"] - 1
            true = np.array([numbers(tone[axis])[tile] for tone in said]) * metres
            if not (same(found["data"], true, 1e-11) and np.allclose(found["x"], [131.7, 317.3], atol=1e-2)):
                check(f"UNV: function at node {tile + 1}, {axis}", False)
        check("UNV: functions at nodes", True)

        gif, _ = shapes("gif")
        probe = ["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=codec_name,nb_read_frames", "-of", "json"]
        stream = json.loads(subprocess.run([*probe, gif], check=True, stdout=subprocess.PIPE).stdout)["streams"][0]
        check("GIF: 24 frames", stream["codec_name"] == "gif" and stream["nb_read_frames"] == "24")
        film, _ = shapes("y4m")
        stream = json.loads(subprocess.run([*probe, film], check=True, stdout=subprocess.PIPE).stdout)["streams"][0]
        check("Y4M: 144 frames", stream["codec_name"] in ("rawvideo", "wrapped_avframe") and stream["nb_read_frames"] == "144")


main()
