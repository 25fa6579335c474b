// ---- What comes in, and all of it drawn ----

const DATA = { reports: [], epoch: null, id: 0, curve: null, state: null, chosenTrack: null, chosenAlarm: null, heard: 0, pictures: -1 };
const MOST_REPORTS = 600;

const newest = () => DATA.reports[DATA.reports.length - 1];

function takeReport(report) {
  DATA.reports.push(report);
  if (DATA.reports.length > MOST_REPORTS) DATA.reports.splice(0, DATA.reports.length - MOST_REPORTS);
  if (report.roi) PICTURE.part = report.roi;
}

function restart(epoch) {
  DATA.reports = [];
  DATA.epoch = epoch;
}

/** Which peak the orbit is of: the track that was clicked, else the strongest. */
function chosenIndex(report) {
  const found = report.peaks.findIndex((peak) => peak.track === DATA.chosenTrack);
  return found >= 0 ? found : 0;
}

/** Why a tone is not plain. */
function flags(peak) {
  const list = [];
  if (peak.harmonic) list.push([`${peak.harmonic}×`, "", "so many times the running speed"]);
  if (peak.ambiguous) list.push(["ambiguous", "look", "it may be another frequency: near a multiple of the frame rate, or weak and not seen before"]);
  if (peak.rigid === false) list.push(["not rigid", "", "its amplitude differs over the rows: the largest is shown"]);
  if (peak.decay_s) list.push([`decays in ${digits(peak.decay_s, 2)} s`, "", "a blow"]);
  if (peak.hz_per_s) list.push([`${digits(peak.hz_per_s, 2)} Hz/s`, "", "its frequency rises or falls"]);
  return list;
}

/** The phase of the larger axis at the first frame's start, degrees. */
function phaseOf(peak) {
  const phase = peak.y_px > peak.x_px ? peak.y_phase_rad : peak.phase_rad;
  return Number.isFinite(phase) ? (Math.round((phase * 1800) / Math.PI) / 10).toFixed(1) : "–";
}

function drawPeaks(report) {
  const [scale, unit] = unitOf(report);
  const scaled = unit === "µm";
  const both = report.peaks.some((peak) => Number.isFinite(peak.y_px));
  const phased = report.peaks.some((peak) => Number.isFinite(peak.phase_rad));
  const columns = [["Hz"], ["amplitude", unit], ...(both ? [["x", unit, "wide"], ["y", unit, "wide"]] : []), ...(scaled ? [["velocity", "mm/s"]] : []), ["SNR", "dB", "wide"], ...(phased ? [["phase", "°", "wide"]] : []), [""]];
  $("peaks-head").replaceChildren(...columns.map(([name, of, wide]) => {
    const head = element("th", name, wide);
    head.scope = "col";
    if (of) head.append(" ", element("small", of));
    return head;
  }));
  const cell = (value, sd, wide) => {
    const made = element("td", value === null || value === undefined ? "–" : measured(value * scale, sd * scale), wide);
    const text = sd && value !== null ? `± ${digits(sd * scale, 1)}` : "";
    // Both axes know their own; there is room for one.
    if (text && !wide) made.append(" ", element("small", text));
    made.title = text;
    return made;
  };
  const chosen = chosenIndex(report);
  $("peaks").replaceChildren(...report.peaks.map((peak, k) => {
    const row = element("tr", undefined, k === chosen ? "chosen" : "");
    row.tabIndex = 0;
    row.setAttribute("aria-selected", k === chosen);
    row.onclick = () => { DATA.chosenTrack = peak.track; draw(); };
    row.onkeydown = (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); row.onclick(); } };
    const hz = element("td", measured(peak.hz, peak.hz_sd));
    if (peak.hz_sd) hz.append(" ", element("small", `± ${digits(peak.hz_sd, 1)}`));
    const notes = element("td");
    for (const [text, kind, title] of flags(peak)) {
      const flag = element("span", text, `flag ${kind}`);
      flag.title = title;
      notes.append(flag);
    }
    row.append(hz, cell(peak.amplitude_px, peak.amplitude_px_sd));
    if (both) row.append(cell(peak.x_px, peak.x_px_sd, "wide"), cell(peak.y_px, peak.y_px_sd, "wide"));
    if (scaled) row.append(element("td", digits(peak.velocity_mm_s_rms, 3)));
    row.append(element("td", peak.snr_db.toFixed(1), "wide"));
    if (phased) row.append(element("td", phaseOf(peak), "wide"));
    row.append(notes);
    return row;
  }));
  $("no-peaks").hidden = report.peaks.length > 0;
  $("no-peaks").textContent = "no vibration above the noise";
  const where = report.axes === "x" ? "; along the rows alone" : "";
  $("peaks-note").textContent = `${digits(report.window_s, 3)} s, ending at ${report.t_s.toFixed(2)} s; ${count(report.lines)} rows at ${digits(report.fps, 5)} fps${where}`;
}

function drawFigures(report) {
  const [scale, unit] = unitOf(report);
  const peak = report.peaks[0];
  figure("figure-hz", peak ? measured(peak.hz, Math.max(peak.hz_sd, 0.001)) : "none", peak ? "Hz" : "");
  figure("figure-amplitude", peak ? digits(peak.amplitude_px * scale, 4) : "–", peak ? unit : "");
  const velocity = report.velocity_mm_s_rms;
  figure("figure-velocity", Number.isFinite(velocity) ? digits(velocity, 3) : "–", Number.isFinite(velocity) ? `mm/s${report.zone ? ` · zone ${report.zone}` : ""}` : "needs a scale");
  figure("figure-noise", digits(report.noise_px * scale, 2), unit);
}

/** The counters of the device, and of this page. */
function drawCounters(state) {
  const c = state.counters;
  const rows = [
    ["rows measured", count(c.rows)],
    ["frames lost", count(c.lost_frames), c.lost_frames > 0],
    ["reports lost or dropped", count(c.dropped_reports), c.dropped_reports > 0],
    ["pictures shown / passed over", `${count(c.pictures)} / ${count(c.missed_pictures)}`],
    ["requests refused", count(c.refused_requests)],
    ["line time", state.about.line_time_us ? `${digits(state.about.line_time_us, 5)} µs` : "–"],
    ["exposure", state.about.exposure_us ? `${digits(state.about.exposure_us, 4)} µs` : "not known"],
    ["running for", duration(state.up_s)],
    ["version", state.version],
  ];
  $("counters").replaceChildren(...rows.flatMap(([name, value, look]) => [element("dt", name), element("dd", value, look ? "look" : "")]));
}

function drawState() {
  const state = DATA.state;
  if (!state) return;
  const silent = !STILL && performance.now() - DATA.heard > 6000;
  const level = silent ? "bad" : state.state.level;
  $("state").className = `state ${level}`;
  $("state").lastElementChild.textContent = silent ? "the device does not answer" : state.state.text;
  const age = state.age_s === null ? null : state.age_s + (STILL ? 0 : (performance.now() - DATA.heard) / 1000);
  $("age").textContent = age === null || !state.live ? "" : `report ${age < 10 ? age.toFixed(1) : duration(age)}${age < 10 ? " s" : ""} ago`;
  $("source").textContent = state.about.name.split("/").pop() || state.about.name;
  $("source").title = state.about.name;
  document.title = `${newest()?.peaks[0] ? `${digits(newest().peaks[0].hz, 5)} Hz · ` : ""}${state.about.name || "rowtone"}`;
  const advice = state.advice.map((one) => element("li", one.text, one.level));
  if ($("advice").textContent !== advice.map((a) => a.textContent).join("")) $("advice").replaceChildren(...advice);
  PICTURE.size = state.about.picture ?? PICTURE.size;
  if (state.about.part && !newest()?.roi) PICTURE.part = state.about.part;
  $("no-picture").textContent = state.about.picture || !state.live ? "no picture yet" : "a board on a serial line sends no pictures";
  for (const id of ["clip", "clip-json"]) $(id).hidden = !state.about.picture;
  showAim(state.aim, newest());
  drawCounters(state);
}

function draw() {
  const report = newest();
  drawState();
  drawPicture();
  if (!report) {
    $("peaks").replaceChildren();
    for (const id of ["figure-hz", "figure-amplitude", "figure-velocity", "figure-noise"]) figure(id, "–");
    $("no-peaks").hidden = false;
    $("no-peaks").textContent = "waiting for the first report";
    return;
  }
  const chosen = chosenIndex(report);
  for (const unit of document.querySelectorAll(".unit")) unit.textContent = unitOf(report)[1];
  drawFigures(report);
  drawPeaks(report);
  drawSpectrum(report, DATA.reports, chosen);
  drawWaterfall(DATA.reports);
  drawAlarms(report);
  drawTrend(DATA.reports);
  if (DATA.curve?.t_ms.length) drawMotion(DATA.curve, report);
  const peak = report.peaks[chosen];
  $("orbit-note").textContent = peak ? `${digits(peak.hz, 4)} Hz` : "";
  drawOrbit(peak, report);
  document.body.dataset.peaks = report.peaks.map((p) => p.hz).join(",");
}

let due = false;
/** Draws once before the next picture on the screen, however much has come. */
function soon() {
  if (due) return;
  due = true;
  requestAnimationFrame(() => { due = false; draw(); });
}

function takeState(state) {
  DATA.heard = performance.now();
  DATA.state = state;
  soon();
}

const json = async (path) => {
  const answer = await fetch(path);
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer.json();
};

/** Events; where they are blocked, the same by asking every second. */
function follow() {
  const events = new EventSource("/api/reports");
  let opened = false;
  const poll = () => {
    events.close();
    setInterval(async () => {
      try {
        const list = await json(`/api/reports?after=${DATA.id}`);
        if (DATA.epoch !== null && list.epoch !== DATA.epoch) { restart(list.epoch); DATA.id = 0; refresh(); return; }
        DATA.epoch = list.epoch;
        list.reports.forEach(takeReport);
        DATA.id = list.id;
        takeState(await json("/api/state"));
      } catch { soon(); }
    }, 1000);
  };
  const patience = setTimeout(() => { if (!opened) poll(); }, 5000);
  const heard = () => { opened = true; clearTimeout(patience); DATA.heard = performance.now(); };
  events.addEventListener("report", (event) => {
    heard();
    takeReport(JSON.parse(event.data));
    [DATA.epoch, DATA.id] = event.lastEventId.split("-").map(Number);
    soon();
  });
  events.addEventListener("state", (event) => { heard(); takeState(JSON.parse(event.data)); });
  events.addEventListener("restart", () => { heard(); restart(null); refresh(); soon(); });
}

/** What is asked for beside the events. */
async function refresh() {
  try {
    takeState(await json("/api/state"));
    fillSettings(await json("/api/settings"));
  } catch { soon(); }
}

async function motion() {
  if (document.hidden || !DATA.state?.about.picture) return;
  try { DATA.curve = await json("/api/motion"); soon(); } catch { /* the next one may come */ }
}

/** The next picture, where there is another one and somebody looks. */
async function picture() {
  try {
    const pictures = DATA.state?.counters.pictures ?? 0;
    if (document.hidden || !pictures || (pictures === DATA.pictures && !DATA.state.live)) return;
    DATA.pictures = pictures;
    const answer = await fetch("/api/picture.jpg");
    if (answer.ok) {
      PICTURE.bitmap = await createImageBitmap(await answer.blob());
      $("no-picture").hidden = true;
      soon();
    }
  } catch { /* the next one may come */ } finally { setTimeout(picture, 200); }
}

/** Everything from the file itself. */
async function still() {
  document.querySelectorAll(".live-only").forEach((one) => { one.hidden = true; });
  STILL.reports.forEach(takeReport);
  DATA.curve = STILL.motion;
  SETTINGS.current = STILL.settings;
  DATA.state = STILL.state;
  if (STILL.picture) {
    const image = new Image();
    image.src = STILL.picture;
    await image.decode();
    PICTURE.bitmap = image;
    $("no-picture").hidden = true;
  }
  draw();
}

addEventListener("resize", soon);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", soon);
if (STILL) still();
else {
  listenToPicture();
  listenToSettings();
  listenToShapes();
  refresh().then(() => { follow(); picture(); motion(); });
  setInterval(motion, 700);
  setInterval(soon, 1000);
}
