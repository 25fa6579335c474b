#!/usr/bin/env python3
"""What a recording's own texture and noise let any method know of a shape, against what `rowtone shapes` says it knows.

    tools/shapes-bound.py clip.y4m --hz 131.7 --line-time-us 48 --exposure-us 200 [--rowtone target/release/rowtone]

The Cramér-Rao bound of one tile: its pixels' slopes g and noise variances s2 (of the recording itself, so light's noise
too) make J = sum g g^T / s2, the information of one frame on (u, v), and a real or imaginary part of a tone over N frames
has at least the covariance 2/N J^-1. Printed: stated deviations over it, and the modal assurance criterion that a shape of
the measured size would have if nothing but that noise, or the stated deviations, stood between it and the truth. Needs
numpy, and a grey 8-bit Y4M whose largest motion is some hundredths of a pixel.
"""

import argparse, io, subprocess, tempfile

import numpy as np

SLOPE = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])  # central differences of eighth order


def frames_of(path):
    data = open(path, "rb")
    head = data.readline().split()
    width, height = (next(int(word[1:]) for word in head if word[:1] == letter) for letter in (b"W", b"H"))
    if not any(word == b"Cmono" for word in head):
        raise SystemExit("shapes-bound.py: grey 8-bit Y4M (Cmono) only")
    while data.readline().startswith(b"FRAME"):
        picture = data.read(width * height)
        if len(picture) == width * height:
            yield np.frombuffer(picture, np.uint8).reshape(height, width).astype(float)


def slope(picture, axis):
    """Slope of each pixel, and by how much noise in the picture is in its square."""
    sum_ = np.zeros_like(picture)
    for k, weight in enumerate(SLOPE, 1):
        sum_ += weight * (np.roll(picture, -k, axis) - np.roll(picture, k, axis))
    return sum_, 2 * (SLOPE**2).sum()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clip")
    parser.add_argument("--hz", required=True)
    parser.add_argument("--line-time-us", required=True)
    parser.add_argument("--exposure-us", required=True)
    parser.add_argument("--rowtone", default="target/release/rowtone")
    args = parser.parse_args()
    with tempfile.NamedTemporaryFile(suffix=".npz") as file:
        camera = ["--line-time-us", args.line_time_us, "--exposure-us", args.exposure_us]
        subprocess.run([args.rowtone, "shapes", args.clip, *camera, "--hz", args.hz, "-o", file.name], check=True,
                       stdout=subprocess.DEVNULL)
        said = dict(np.load(io.BytesIO(open(file.name, "rb").read())))

    count, total, squares, before = 0, 0.0, 0.0, None
    for picture in frames_of(args.clip):
        total = total + picture
        if before is not None:
            squares = squares + (picture - before) ** 2
        before, count = picture, count + 1
    mean, variance = total / count, squares / (2 * (count - 1))
    variance = np.maximum(variance, 1 / 12)  # rounding
    tile = int(said["tile"])
    rows, columns = said["x"].shape[1:]
    cut = lambda all_: all_[:rows * tile, :columns * tile].reshape(rows, tile, columns, tile).sum((1, 3))
    (right, noise), (down, _) = slope(mean, 1), slope(mean, 0)
    extra = cut(np.full_like(mean, noise / count))  # the mean picture's own noise, over its variance
    xx, yy, xy = cut(right**2 / variance) - extra, cut(down**2 / variance) - extra, cut(right * down / variance)
    det = xx * yy - xy**2
    gain = np.sinc(float(args.hz) * float(args.exposure_us) * 1e-6)
    bound = {"x": 2 / count * yy / det / gain**2, "y": 2 / count * xx / det / gain**2}

    ratios, limit, stated, size = [], 0.0, 0.0, 0.0
    for axis in "xy":
        px, sd = said[axis][0], said[axis + "_sd"][0]
        known = np.isfinite(sd) & np.isfinite(px) & (bound[axis] > 0)
        ratios += list(sd[known] / np.sqrt(bound[axis][known]))
        size += (abs(px[known]) ** 2).sum() - 2 * (sd[known] ** 2).sum()
        limit += 2 * bound[axis][known].sum()
        stated += 2 * (sd[known] ** 2).sum()
    low, middle, high = np.percentile(ratios, [10, 50, 90])
    print(f"{len(ratios)} components of {rows * columns} tiles, {count} frames")
    print(f"stated deviation over its bound: {middle:.2f} (10 % below {low:.2f}, 10 % above {high:.2f})")
    print(f"MAC by the bound {size / (size + limit):.4f}, by the stated deviations {size / (size + stated):.4f}")


main()
