#!/usr/bin/env python3
"""Measures the figures in README.md and docs/desktop.md again and writes them, and the picture in docs/, anew.

    cargo build --release -p rowtone-cli && python3 tools/readme-figures.py

What stands between <!-- NAME --> and <!-- /NAME --> in these pages is replaced.
"""
import json
import os
import pathlib
import re
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
SENSORS = {
    "ov5647": "OV5647 640x480",
    "imx219-1080p": "IMX219 1080p",
    "imx219-480p": "IMX219 640x480 binned",
    "imx477": "IMX477 1332x990",
    "imx708": "IMX708 1536x864",
    "hm01b0": "HM01B0 320x240 (microcontroller)",
}
SIMULATE = "simulate --seconds 8 --tone 24.7:0.3 --tone 49.4:0.08 --tone 317.6:0.015 --tone 187.4:0.04 -o clip.y4m"
ANALYZE = "analyze clip.y4m --line-time-us 40 --exposure-us 500 --hop 0.25 --max-hz 500 --plot analyze.png"


def rowtone(folder, *options):
    command = [str(TARGET / "release" / "rowtone"), *options]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout


def indented(text):
    return "\n".join("    " + line if line else "" for line in text.split("\n"))


def demo(folder):
    """The demo's first window and its end."""
    parts = rowtone(folder).strip().split("\n\n")
    return indented("\n\n".join([*parts[:2], "...", *parts[-2:]]))


def picture(folder):
    """The picture, and the commands that make it."""
    rowtone(folder, *SIMULATE.split())
    rowtone(folder, *ANALYZE.split())
    (ROOT / "docs" / "analyze.png").write_bytes((folder / "analyze.png").read_bytes())
    return indented(f"rowtone {SIMULATE}\nrowtone {ANALYZE}")


def sensors(folder):
    """One second of each sensor."""
    rows = [
        "| sensor, mode | line time, µs | fps | noise of a row, px | bound, px | frequency ± sd, Hz | amplitude ± sd, px |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, label in SENSORS.items():
        clip = "--seconds 1.02 --tone 131.7:0.05 -o clip.y4m --truth truth.json"
        rowtone(folder, "simulate", "--preset", name, *clip.split())
        truth = json.loads((folder / "truth.json").read_text())
        camera = ["--line-time-us", str(truth["line_time_us"]), "--exposure-us", str(truth["exposure_us"])]
        lines = rowtone(folder, "analyze", "clip.y4m", *camera, "--format", "json").splitlines()
        report = json.loads(lines[0])
        peak = report["peaks"][0]
        rows.append(
            f"| {label} | {truth['line_time_us']:.2f} | {truth['fps']:.1f} | {report['noise_px']:.4f} "
            f"| {truth['crlb_px_median']:.4f} | {peak['hz']:.4f} ± {peak['hz_sd']:.4f} "
            f"| {peak['amplitude_px']:.5f} ± {peak['amplitude_px_sd']:.6f} |"
        )
    return "\n".join(rows)


def sample(folder):
    """A clip, and what the program says of its first window."""
    commands = [
        "simulate --seconds 3 --tone 24.7:0.3 --tone 49.4:0.08 --tone 317.6:0.015 -o clip.y4m",
        "analyze clip.y4m --line-time-us 40 --exposure-us 500 --um-per-px 100",
    ]
    said = [rowtone(folder, *command.split()) for command in commands][-1].rstrip().split("\n")
    windows = [number for number, line in enumerate(said) if not line.startswith("     ")]
    shown = [*said[: windows[1]], "    ...", *said[windows[-1] :]]
    return "\n".join([f"    rowtone {command}" for command in commands] + [""] + ["    " + line for line in shown])


def main():
    pages = [ROOT / "README.md", ROOT / "docs" / "desktop.md"]
    texts = [page.read_text() for page in pages]
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for part in (demo, picture, sample, sensors):
            name = part.__name__
            pattern = re.compile(rf"<!-- {name} -->.*?<!-- /{name} -->", re.S)
            new = f"<!-- {name} -->\n\n{part(folder)}\n\n<!-- /{name} -->"
            replaced = [pattern.subn(lambda _: new, text) for text in texts]
            assert sum(count for _, count in replaced) == 1, f"no page has one place for {name}"
            texts = [text for text, _ in replaced]
    for page, text in zip(pages, texts):
        page.write_text(text)


if __name__ == "__main__":
    main()
