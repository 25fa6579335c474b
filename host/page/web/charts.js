// ---- Charts: each draws one canvas from what is known ----

const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** A canvas ready to draw on, in CSS pixels, cleared. */
function canvas(id) {
  const element = $(id);
  const box = element.getBoundingClientRect();
  const scale = window.devicePixelRatio || 1;
  const [width, height] = [Math.round(box.width * scale), Math.round(box.height * scale)];
  if (element.width !== width || element.height !== height) [element.width, element.height] = [width, height];
  const g = element.getContext("2d");
  g.setTransform(scale, 0, 0, scale, 0, 0);
  g.clearRect(0, 0, box.width, box.height);
  g.font = "12px system-ui, sans-serif";
  g.lineJoin = "round";
  return { g, width: box.width, height: box.height, element };
}

/** Straight axes with a grid: where values stand, and the frame around them. */
function axes({ g, width, height }, x, y) {
  const area = { left: y.room ?? 46, right: width - 8, top: 8, bottom: height - 22 };
  const along = (axis, from, to) => (value) => from + ((value - axis.from) / (axis.to - axis.from || 1)) * (to - from);
  const atX = along(x, area.left, area.right);
  const atY = along(y, area.bottom, area.top);
  g.lineWidth = 1;
  g.fillStyle = style("--soft");
  g.strokeStyle = style("--faint");
  g.textBaseline = "middle";
  g.textAlign = "right";
  for (const [value, label] of y.ticks) {
    const at = Math.round(atY(value)) + 0.5;
    g.beginPath(); g.moveTo(area.left, at); g.lineTo(area.right, at); g.stroke();
    g.fillText(label, area.left - 6, at);
  }
  g.textBaseline = "alphabetic";
  for (const [value, label] of x.ticks) {
    const at = Math.round(atX(value)) + 0.5;
    g.beginPath(); g.moveTo(at, area.top); g.lineTo(at, area.bottom); g.stroke();
    const wide = g.measureText(label).width / 2;
    g.textAlign = at + wide > width ? "right" : "center";
    g.fillText(label, g.textAlign === "right" ? width : at, height - 6);
  }
  return { atX, atY, area };
}

/** Round values from `from` to `to`, at most so many, the last with its unit. */
function ticks(from, to, most, unit, show = (v) => String(v)) {
  const step = roundStep((to - from) / most || 1);
  const values = [];
  for (let k = Math.ceil(from / step - 1e-6); k * step <= to * (1 + 1e-9) + 1e-12; k++) values.push(k * step);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return values.map((v, k) => [v, show(v.toFixed(decimals)) + (unit && k === values.length - 1 ? ` ${unit}` : "")]);
}

/** The upper end of the frequency axis: a round number above all tones shown. */
function topHz(reports) {
  const highest = Math.max(10, ...reports.flatMap((r) => r.peaks.map((p) => p.hz)));
  return [1, 1.5, 2, 3, 4, 5, 7.5, 10, 15].map((m) => m * 10 ** Math.floor(Math.log10(highest))).find((v) => v > highest * 1.08);
}

/** Amplitude that noise alone gives a tone in this window, px, as steps [to_hz, px]. */
function floorOf(report) {
  const window = Math.max(report.window_s, 1e-3);
  if (report.noise_floor?.length) return report.noise_floor.map(([hz, density]) => [hz, density / Math.sqrt(window)]);
  const sd = Math.min(...report.peaks.map((p) => p.amplitude_px_sd).filter((v) => v > 0));
  return Number.isFinite(sd) ? [[Infinity, sd]] : [];
}

function drawSpectrum(report, reports, chosen) {
  const c = canvas("spectrum");
  const { g } = c;
  const steps = floorOf(report);
  const [scale] = unitOf(report);
  const all = [...report.peaks.map((p) => p.amplitude_px), ...steps.map((s) => s[1])].filter((v) => v > 0).map((v) => v * scale);
  if (!all.length) all.push(1e-4, 1e-2);
  const from = Math.floor(Math.log10(Math.min(...all)) - 0.5);
  const to = Math.max(from + 2, Math.log10(Math.max(...all)) + 0.45);
  const toHz = topHz(reports);
  const decades = Array.from({ length: Math.floor(to) - from + 1 }, (_, k) => from + k);
  const label = (d) => (d >= -3 ? String(+(10 ** d).toFixed(6)) : `1e${d}`);
  const { atX, atY, area } = axes(c, { from: 0, to: toHz, ticks: ticks(0, toHz, 7, "Hz") }, { from, to, ticks: decades.map((d) => [d, label(d)]), room: 52 });
  // The noise floor as steps.
  g.fillStyle = style("--line");
  let before = 0;
  for (const [hz, px] of steps) {
    const [left, right] = [atX(Math.min(before, toHz)), atX(Math.min(hz, toHz))];
    const top = Math.min(area.bottom, atY(Math.log10(px * scale)));
    g.fillRect(left, top, right - left, area.bottom - top);
    before = hz;
  }
  // Tones as stems, the largest last so that its label comes first.
  const taken = [];
  const free = (box) => !taken.some((t) => box[0] < t[1] && box[1] > t[0] && box[2] < t[3] && box[3] > t[2]);
  report.peaks.forEach((peak, k) => {
    const [x, y] = [atX(peak.hz), atY(Math.log10(peak.amplitude_px * scale))];
    if (x > area.right + 1) return;
    g.strokeStyle = g.fillStyle = style(peak.ambiguous ? "--soft" : "--x");
    g.lineWidth = k === chosen ? 3.5 : 2;
    g.setLineDash(peak.ambiguous ? [4, 3] : []);
    g.beginPath(); g.moveTo(x, area.bottom); g.lineTo(x, y); g.stroke();
    g.setLineDash([]);
    g.beginPath(); g.arc(x, y, k === chosen ? 5 : 3.5, 0, 7); g.fill();
    const text = digits(peak.hz, peak.hz < 100 ? 4 : 5);
    const wide = g.measureText(text).width;
    const left = Math.min(Math.max(x - wide / 2, area.left), area.right - wide);
    const spot = [y - 9, y - 23].find((base) => free([left - 3, left + wide + 3, base - 12, base + 2]));
    if (spot > 8) {
      taken.push([left - 3, left + wide + 3, spot - 12, spot + 2]);
      g.fillStyle = style("--text");
      g.textAlign = "left";
      g.fillText(text, left, spot);
    }
  });
  c.element.setAttribute("aria-label", report.peaks.length ? `Spectrum: tones at ${report.peaks.map((p) => digits(p.hz, 5)).join(", ")} Hz` : "Spectrum: no tone above the noise");
}

/** Light to dark over three decades of amplitude. */
function heat(share) {
  const stops = matchMedia("(prefers-color-scheme: dark)").matches
    ? [[28, 40, 48], [18, 104, 116], [88, 207, 214], [245, 255, 220]]
    : [[222, 234, 236], [110, 180, 186], [11, 106, 114], [8, 40, 52]];
  const at = Math.min(0.9999, Math.max(0, share)) * (stops.length - 1);
  const [a, b, part] = [stops[Math.floor(at)], stops[Math.floor(at) + 1], at % 1];
  return `rgb(${a.map((v, k) => Math.round(v + (b[k] - v) * part)).join(",")})`;
}

function drawWaterfall(reports) {
  const c = canvas("waterfall");
  const { g } = c;
  const newest = reports[reports.length - 1];
  const shown = reports.slice(-120);
  const toHz = topHz(reports);
  const span = Math.max(newest.t_s - shown[0].t_s, newest.window_s, 1e-3);
  const y = { from: -span, to: 0, ticks: ticks(-span, 0, 4, "").map(([v, l]) => [v, Math.abs(v) < 1e-9 ? "now" : `${l} s`]), room: 52 };
  const { atX, atY, area } = axes(c, { from: 0, to: toHz, ticks: ticks(0, toHz, 8, "Hz") }, y);
  const largest = Math.max(1e-9, ...shown.flatMap((r) => r.peaks.map((p) => p.amplitude_px)));
  const each = Math.max(2, (area.bottom - area.top) / Math.max(1, shown.length - 1) + 1);
  for (const report of shown) {
    const top = atY(report.t_s - newest.t_s);
    for (const peak of report.peaks) {
      const x = atX(peak.hz);
      if (x > area.right) continue;
      g.fillStyle = heat(1 + Math.log10(peak.amplitude_px / largest) / 3);
      g.fillRect(x - 2.5, top, 5, Math.min(each + 0.5, area.bottom - top));
    }
  }
  c.element.setAttribute("aria-label", `Tones of the last ${shown.length} reports over ${span.toFixed(0)} seconds`);
}

function drawMotion(curve, report) {
  const c = canvas("motion");
  const { g } = c;
  const [scale] = unitOf(report);
  const known = (list) => list.filter((v) => v !== null);
  const both = [...known(curve.x_px), ...known(curve.y_px)].map((v) => Math.abs(v) * scale).sort((a, b) => a - b);
  const top = roundStep(Math.max(1e-4, (both[Math.floor(both.length * 0.995)] || 0) * 1.1));
  const length = curve.t_ms[curve.t_ms.length - 1] || 1;
  const { atX, atY, area } = axes(c, { from: 0, to: length, ticks: ticks(0, length, 5, "ms") }, { from: -top, to: top, ticks: ticks(-top, top, 4, "") });
  g.save();
  g.beginPath(); g.rect(area.left, area.top - 4, area.right - area.left, area.bottom - area.top + 8); g.clip();
  for (const [values, colour] of [[curve.y_px, "--y"], [curve.x_px, "--x"]]) {
    g.strokeStyle = style(colour);
    g.lineWidth = 1.6;
    g.beginPath();
    let last = null;
    values.forEach((value, k) => {
      if (value === null) { last = null; return; }
      const point = [atX(curve.t_ms[k]), atY(value * scale)];
      // Between frames the camera sees nothing.
      if (last === curve.frame[k]) g.lineTo(...point); else g.moveTo(...point);
      last = curve.frame[k];
    });
    g.stroke();
  }
  g.restore();
  $("motion-y").hidden = !known(curve.y_px).length;
}

function drawOrbit(peak, report) {
  const c = canvas("orbit");
  const { g, width, height } = c;
  const [scale, unit] = unitOf(report);
  const [x, y] = [(peak?.x_px ?? peak?.amplitude_px ?? 0) * scale, (peak?.y_px ?? 0) * scale];
  const top = roundStep(Math.max(1e-6, Math.hypot(x, y) * 1.02));
  const half = Math.min(width, height - 24) / 2 - 4;
  const [cx, cy] = [width / 2, (height - 24) / 2 + 2];
  g.strokeStyle = style("--faint");
  g.lineWidth = 1;
  for (const r of [0.5, 1]) { g.beginPath(); g.arc(cx, cy, half * r, 0, 7); g.stroke(); }
  g.beginPath(); g.moveTo(cx - half, cy); g.lineTo(cx + half, cy); g.moveTo(cx, cy - half); g.lineTo(cx, cy + half); g.stroke();
  g.fillStyle = style("--soft");
  g.textAlign = "center";
  g.fillText(`radius ${digits(top, 1)} ${unit}`, cx, height - 6);
  if (!peak) return;
  const [px, py] = [peak.phase_rad ?? 0, peak.y_phase_rad ?? 0];
  g.strokeStyle = style("--x");
  g.lineWidth = 2.5;
  g.beginPath();
  for (let k = 0; k <= 120; k++) {
    const turn = (k / 60) * Math.PI;
    // y is positive downwards, as in the picture and on the canvas.
    g.lineTo(cx + (half * x * Math.sin(turn + px)) / top, cy + (half * y * Math.sin(turn + py)) / top);
  }
  g.stroke();
  c.element.setAttribute("aria-label", `Orbit at ${digits(peak.hz, 5)} Hz: x ${digits(x, 3)} ${unit}, y ${digits(y, 3)} ${unit}`);
}

/** Scale and unit of amplitudes: µm where the scale is known. */
function unitOf(report) {
  const peak = report?.peaks?.find((p) => p.amplitude_um);
  if (peak) return [peak.amplitude_um / peak.amplitude_px, "µm"];
  return SETTINGS.current?.["um-per-px"] && !report?.peaks?.length ? [SETTINGS.current["um-per-px"], "µm"] : [1, "px"];
}
