#!/usr/bin/env python3
"""What an encoder takes and key frames give back: rowtone on clips that this makes, as a table.

Five scenes x H.264 and HEVC x 0.13 and 0.33 bits a pixel x a key frame each 0.25 or 1 s (0.5 s where B frames are
among them), 320x240 px at 60 fps, 8 s, with one or two tones of 0.1 px; and the same scenes at rest. For each clip:
the worst window's amplitude, as an error and in standard deviations, the stated deviation, and false tones that are
not marked. Exit status 1 if a tone is off by more than the larger of 3 % and 3 sd, or missing, in any window, or if
more than one window in a hundred has a false sure tone.

    python3 tools/video-table.py [target/release/rowtone] [--only WORD] [--seconds 8]

Needs ffmpeg with libx264 and libx265. Some 20 minutes."""
import json
import os
import subprocess
import sys
import tempfile

SCENES = {
    "speckle": ["--scene", "speckle"],
    "soft": ["--scene", "speckle", "--grain-px", "4"],
    "photo": ["--scene", "photo", "--sky", "0"],
    "edges": ["--scene", "edges"],
    "pale": ["--scene", "speckle", "--dark", "0.35", "--bright", "0.65"],
}
TONES = {"speckle": [83.3], "soft": [131.7], "photo": [83.3, 211.9], "edges": [47.7], "pale": [97.3]}
CAMERA = ["--line-time-us", "60", "--exposure-us", "500"]
PX, SIZE, FPS = 0.1, "320x240", 60


def call(*words):
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(words[:3])} …: {done.stderr.strip()}")
    return done.stdout


def encode(raw, out, codec, bits, every_s, options):
    rate = int(bits * 320 * 240 * FPS)
    key = int(every_s * FPS)
    # A phone's encoder: one pass, a buffer of a second, key frames by the clock alone.
    if codec == "h264":
        coder = ["-c:v", "libx264", "-sc_threshold", "0", "-g", str(key), "-keyint_min", str(key)]
    else:
        coder = ["-c:v", "libx265", "-x265-params", f"keyint={key}:min-keyint={key}:scenecut=0:log-level=none"]
    call("ffmpeg", "-v", "error", "-y", "-i", raw, "-pix_fmt", "yuv420p", *coder, "-b:v", str(rate),
         "-maxrate", str(rate), "-bufsize", str(rate), *options, out)


def score(reports, tones):
    worst, worst_sd, stated, missing, false_windows = 0.0, 0.0, 0.0, 0, 0
    right = True
    for report in (r for r in reports if r["window_s"] > 0.9):
        left = list(report["peaks"])
        for hz in tones:
            near = [p for p in left if abs(p["hz"] - hz) < 0.05 + 3 * p["hz_sd"]]
            if not near:
                missing += 1
                continue
            peak = max(near, key=lambda p: p["amplitude_px"])
            left.remove(peak)
            off, sd = peak["amplitude_px"] / PX - 1, peak["amplitude_px_sd"] / PX
            right &= abs(off) <= max(0.03, 3 * sd)
            worst, worst_sd = max(worst, off, key=abs), max(worst_sd, abs(off) / sd)
            stated = max(stated, sd)
        false_windows += any(not p["ambiguous"] for p in left)
    return worst, worst_sd, stated, missing, false_windows, right and not missing


def main():
    words = sys.argv[1:]
    take = lambda name, other: words.pop(words.index(name) + 1) if name in words else other
    only, seconds = take("--only", ""), take("--seconds", "8")
    words = [w for w in words if not w.startswith("--")]
    rowtone = os.path.abspath(words[0] if words else "target/release/rowtone")
    cases = []
    for scene in SCENES:
        for codec in ("h264", "hevc"):
            for bits in (0.13, 0.33):
                for every_s in (0.25, 1.0):
                    b_frames = codec == "h264" and bits == 0.33 and every_s == 0.25
                    options = ["-bf", "2"] if b_frames else ["-bf", "0"]
                    cases.append((scene, codec, bits, 0.5 if b_frames else every_s, options, TONES[scene]))
        cases.append((scene, "h264", 0.13, 0.5, ["-bf", "0"], []))
    print(f"{'clip':<34} {'windows':>7} {'worst':>8} {'in sd':>6} {'sd':>6} {'missing':>7} {'false':>6}  verdict")
    bad, windows, falses = 0, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        raws = {}
        for scene, codec, bits, every_s, options, tones in cases:
            name = f"{scene} {codec} {bits} b/px, {every_s} s{', B' if options[1] != '0' else ''}"
            name += "" if tones else ", still"
            if only not in name:
                continue
            raw = raws.get((scene, bool(tones)))
            if raw is None:
                raw = raws[scene, bool(tones)] = os.path.join(folder, f"{scene}{len(tones)}.y4m")
                moves = sum((["--tone", f"{hz}:{PX}"] for hz in tones), [])
                call(rowtone, "simulate", *SCENES[scene], *CAMERA, "--size", SIZE, "--fps", str(FPS),
                     "--seconds", seconds, *moves, "-o", raw)
            clip = os.path.join(folder, "clip.mp4")
            encode(raw, clip, codec, bits, every_s, options)
            text = call(rowtone, "analyze", clip, *CAMERA, "--roi", "full", "--format", "json")
            reports = [json.loads(line) for line in text.splitlines()]
            worst, worst_sd, stated, missing, false_windows, right = score(reports, tones)
            windows, falses, bad = windows + len(reports), falses + false_windows, bad + (not right)
            figures = f"{100 * worst:>+7.1f}% {worst_sd:>6.1f} {100 * stated:>5.1f}%"
            print(f"{name:<34} {len(reports):>7} {figures} {missing:>7} {false_windows:>6}  {'right' if right else 'WRONG'}",
                  flush=True)
    print(f"{bad} clips wrong; false sure tones in {falses} of {windows} windows")
    sys.exit(bool(bad) or 100 * falses > windows)


if __name__ == "__main__":
    main()
