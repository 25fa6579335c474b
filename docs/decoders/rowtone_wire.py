"""Reads rowtone's `text` and `binary` wires (docs/wire.md) from standard input; prints the reports as JSON Lines."""
import json, struct, sys, zlib

PEAK = ["hz", "hz_sd", "amplitude_px", "amplitude_px_sd", "snr_db", "ambiguous", "track", "harmonic"]
REPORT = ["session", "seq", "time_ms", "window_s", "fps", "lines", "lost_frames", "noise_px", "warnings", "um_per_px", "velocity_mm_s_rms", "peaks"]

def text(line):  # one sentence, from $ to its line end
    body, _, said = line.strip().lstrip(b"$").rpartition(b"*")
    if b"%08X" % zlib.crc32(body) != said or not body.startswith(b"RTRPT,"):
        return None
    f = body.decode().split(",")[1:]
    peaks = [[*map(float, p[:5]), p[7] == "A", int(p[5]), None if p[6] == "-" else int(p[6])] for p in (x.split("/") for x in f[12:])]
    real = lambda s: float(s) if s else None
    return dict(zip(REPORT, [*map(int, f[:3]), *map(real, f[3:5]), *map(int, f[5:7]), real(f[7]), int(f[8], 16), real(f[9]), real(f[10]), [dict(zip(PEAK, p)) for p in peaks]]))

def binary(frame):  # what stands between two zeros
    data = bytearray()
    while frame:
        data, full, frame = data + frame[1:frame[0]], frame[0] == 255, frame[frame[0]:]
        data += b"" if full or not frame else b"\0"
    if len(data) < 6 or zlib.crc32(data[:-4]) != struct.unpack("<I", data[-4:])[0] or data[:2] != b"\x01\x00":
        return None
    rest = iter(data[2:])
    u8 = lambda: next(rest)
    f32 = lambda: struct.unpack("<f", bytes([u8(), u8(), u8(), u8()]))[0]
    def uint(): byte = u8(); return byte if byte < 128 else byte - 128 + 128 * uint()
    option = lambda read: read() if u8() else None
    peak = lambda: dict(zip(PEAK, [*(f32() for _ in range(5)), bool(u8()), uint(), option(u8)]))
    head = [uint(), uint(), uint(), f32(), f32(), uint(), uint(), f32()]
    peaks, warnings = [peak() for _ in range(uint())], uint()
    return dict(zip(REPORT, head + [warnings, option(f32), option(f32), peaks]))

if __name__ == "__main__":
    stream = sys.stdin.buffer.read()
    parts = [binary(p) for p in stream.split(b"\0")] if b"\0" in stream else [text(p) for p in stream.splitlines()]
    for report in filter(None, parts):
        print(json.dumps(report))
