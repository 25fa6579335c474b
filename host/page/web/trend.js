// ---- Alarms, and what they or the velocity were over the reports kept ----

/** A unit as people write it. */
const written = (unit) => unit.replace(/^um/, "µm").replace("s2", "s²");

const LEVELS = { normal: "good", warning: "look", trip: "bad" };

/** How every rule stands; the one whose trend is drawn is marked. Nothing where there are no alarms. */
function drawAlarms(report) {
  const alarms = report.alarms ?? [];
  $("alarms-card").hidden = !alarms.length;
  $("trend-card").className = `card ${alarms.length ? "w5" : "w12"}`;
  if (!alarms.length) return;
  const cell = (text, className) => element("td", text, className);
  const chosen = chosenAlarm(report);
  $("alarms").replaceChildren(...alarms.map((alarm) => {
    const row = element("tr", undefined, alarm === chosen ? "chosen" : "");
    row.tabIndex = 0;
    row.onclick = () => { DATA.chosenAlarm = alarm.name; draw(); };
    row.onkeydown = (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); row.onclick(); } };
    const says = [alarm.level, alarm.acknowledged && "acknowledged", alarm.blind && "blind", alarm.learning && `learning, ${alarm.learning} windows`];
    row.append(cell(alarm.name), cell(says.filter(Boolean).join(", "), alarm.blind ? "look" : LEVELS[alarm.level]));
    row.append(...[alarm.value, alarm.warning_at, alarm.trip_at].map((value) => cell(digits(value, 3))), cell(written(alarm.unit)));
    return row;
  }));
  $("alarms-note").textContent = report.running ? "" : "the machine stands: not judged";
}

function chosenAlarm(report) {
  const alarms = report.alarms ?? [];
  return alarms.find((alarm) => alarm.name === DATA.chosenAlarm) ?? alarms[0];
}

/** What the trend is of: the chosen alarm, else the velocity, else the strongest tone. */
function trendOf(report) {
  const alarm = chosenAlarm(report);
  if (alarm) {
    const of = (r) => r.alarms?.find((one) => one.name === alarm.name);
    return { name: alarm.name, unit: written(alarm.unit), value: (r) => of(r)?.value, limits: [alarm.warning_at, alarm.trip_at] };
  }
  if (Number.isFinite(report.velocity_mm_s_rms)) return { name: "overall, RMS", unit: "mm/s", value: (r) => r.velocity_mm_s_rms, limits: [] };
  const [scale, unit] = unitOf(report);
  return { name: "strongest tone", unit, value: (r) => (r.peaks.length ? r.peaks[0].amplitude_px * scale : null), limits: [] };
}

function drawTrend(reports) {
  const c = canvas("trend");
  const { g } = c;
  const { name, unit, value, limits } = trendOf(reports[reports.length - 1]);
  $("trend-note").textContent = `${name}${unit ? `, ${unit}` : ""}; the last ${reports.length} reports`;
  const [from, to] = [reports[0].t_s, Math.max(reports[reports.length - 1].t_s, reports[0].t_s + 1)];
  const known = [...reports.map(value), ...limits].filter(Number.isFinite);
  const top = roundStep(Math.max(1e-6, ...known) * 1.05);
  const { atX, atY, area } = axes(c, { from, to, ticks: ticks(from, to, 5, "s") }, { from: 0, to: top, ticks: ticks(0, top, 4, "") });
  g.lineWidth = 1.4;
  limits.forEach((limit, k) => {
    if (!Number.isFinite(limit)) return;
    g.strokeStyle = style(k ? "--bad" : "--look");
    g.setLineDash([6, 4]);
    g.beginPath(); g.moveTo(area.left, atY(limit)); g.lineTo(area.right, atY(limit)); g.stroke();
    g.setLineDash([]);
  });
  g.strokeStyle = g.fillStyle = style("--x");
  g.lineWidth = 1.8;
  g.beginPath();
  let drawn = false;
  for (const report of reports) {
    const now = value(report);
    if (!Number.isFinite(now)) { drawn = false; continue; }
    const point = [atX(report.t_s), atY(now)];
    if (drawn) g.lineTo(...point); else g.moveTo(...point);
    drawn = true;
    g.fillRect(point[0] - 1.5, point[1] - 1.5, 3, 3);
  }
  g.stroke();
}
