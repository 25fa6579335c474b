#!/usr/bin/env python3
"""A tine's shape by another way than tiles: where its darkness has its middle, row by row, against `rowtone shapes`.

    tools/fork-shape.py fork-32hz-250fps.mp4 [--rowtone target/release/rowtone]

Of each row of the left tine the middle of what is darker than the light wall around it is taken in every frame, and a
sine fitted to it at the rows' times, with the exposure undone. Of 16 rows the median stands against the tiles that hold
the tine. Needs numpy and ffmpeg; the columns are those of that recording (docs/real-recordings.md).
"""

import argparse, json, subprocess

import numpy as np

FPS, LINE_S, EXPOSURE_S, SIZE = 250, 8.137e-6, 2e-3, (640, 420)
TILE, COLUMNS, ROWS = 16, (19, 20), range(9, 25)
LEFT, WIDTH, TINE = 292, 60, slice(10, 50)
DARKER = 8  # grey values: what is less dark is the wall


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clip")
    parser.add_argument("--rowtone", default="target/release/rowtone")
    args = parser.parse_args()
    camera = ["--fps", str(FPS), "--line-time-us", str(LINE_S * 1e6), "--exposure-us", str(EXPOSURE_S * 1e6)]
    said = subprocess.run([args.rowtone, "shapes", args.clip, *camera, "--hz", "31.972", "--format", "json"], check=True,
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
    shape = json.loads(said)[0]
    crop = ["-vf", f"crop={WIDTH}:{SIZE[1]}:{LEFT}:0", "-pix_fmt", "gray", "-f", "rawvideo", "-"]
    raw = subprocess.run(["ffmpeg", "-v", "error", "-i", args.clip, *crop], check=True, stdout=subprocess.PIPE).stdout
    frames = np.frombuffer(raw, np.uint8).reshape(-1, SIZE[1], WIDTH).astype(float)

    at, number = np.arange(WIDTH), np.arange(len(frames))
    slow = number / len(frames)
    own = []
    for row in range(SIZE[1]):
        pixels = frames[:, row]
        left, right = pixels[:, 4:10].mean(1), pixels[:, 50:56].mean(1)
        wall = left[:, None] + (right - left)[:, None] * (at - 6.5) / 46
        dark = np.clip(wall - pixels - DARKER, 0, None)[:, TINE]
        middle = (dark * at[TINE]).sum(1) / np.maximum(dark.sum(1), 1e-9)
        turn = 2 * np.pi * shape["hz"] * (number / FPS + row * LINE_S + EXPOSURE_S / 2)
        fit = np.linalg.lstsq(np.c_[np.cos(turn), np.sin(turn), np.ones_like(slow), slow, slow**2], middle, rcond=None)[0]
        own.append(complex(fit[0], -fit[1]) / np.sinc(shape["hz"] * EXPOSURE_S))
    own = np.array(own)

    rows, tiles = [], []
    for row in ROWS:
        band = own[row * TILE:(row + 1) * TILE]
        known = [row * shape["cols"] + column for column in COLUMNS if shape["moves"][row * shape["cols"] + column]]
        weights = np.array([shape["x_sd"][tile] ** -2 for tile in known])
        rows.append(complex(np.median(band.real), np.median(band.imag)))
        tiles.append((weights * [complex(*shape["x"][tile]) for tile in known]).sum() / weights.sum())
    rows, tiles = np.array(rows), np.array(tiles)
    product = np.vdot(rows, tiles)
    tiles *= product.conj() / abs(product)
    print("row  of rows, px  of tiles, px  phase, degrees")
    for row, a, b in zip(ROWS, rows, tiles):
        print(f"{row * TILE:3d} {abs(a):12.3f} {abs(b):13.3f} {np.degrees(np.angle(b / a)):15.1f}")
    mac = abs(product) ** 2 / (np.vdot(rows, rows) * np.vdot(tiles, tiles)).real
    scale = abs(product) / np.vdot(rows, rows).real
    print(f"MAC {mac:.4f}, scale {scale:.3f}, rms difference {np.sqrt(np.mean(abs(rows - tiles) ** 2)):.3f} px")


main()
