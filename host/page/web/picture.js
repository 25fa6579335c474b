// ---- The picture: what is seen, which part is measured, what its rows know ----

const PICTURE = {
  /** The newest picture, and the camera's size, which its coordinates are in. */
  bitmap: null, size: null,
  /** Measured now, and chosen but not yet measured: x, y, width, height. */
  part: null, wanted: null,
  /** A line of known length is being drawn: from, to. */
  line: null, drawing: false, start: null,
  aim: null, noise: null, bestFocus: 0, changeable: false,
};

/** Tallest picture on a desk, px: all of the card is seen at once. */
const TALLEST = 400;

/** From the picture's pixels to the canvas and back. */
function pictureScale() {
  const [width, height] = PICTURE.size;
  const element = $("picture");
  const box = element.parentElement.getBoundingClientRect();
  const strip = 12;
  const scale = Math.min((box.width - strip) / width, ((innerWidth > 640 ? TALLEST : 300) - strip) / height);
  return { scale, strip, width: width * scale, height: height * scale };
}

function drawPicture() {
  if (!PICTURE.size || !PICTURE.bitmap) return;
  const { scale, strip, width, height } = pictureScale();
  const element = $("picture");
  element.style.width = `${width + strip}px`;
  element.style.height = `${height + strip}px`;
  const { g } = canvas("picture");
  g.imageSmoothingEnabled = scale < 3;
  g.drawImage(PICTURE.bitmap, 0, 0, width, height);
  const shown = PICTURE.wanted ?? PICTURE.part;
  if (shown) {
    const [x, y, w, h] = shown.map((v) => v * scale);
    // What is not measured steps back.
    g.fillStyle = "#0009";
    g.beginPath(); g.rect(0, 0, width, height); g.rect(x + w, y, -w, h); g.fill("evenodd");
    g.lineWidth = 2;
    g.strokeStyle = "#000a";
    g.strokeRect(x, y, w, h);
    g.strokeStyle = PICTURE.wanted ? "#ffb454" : "#58e0e6";
    g.setLineDash(PICTURE.wanted ? [6, 4] : []);
    g.strokeRect(x, y, w, h);
    g.setLineDash([]);
  }
  if (PICTURE.line?.to) {
    g.strokeStyle = "#ffb454"; g.lineWidth = 3;
    g.beginPath(); g.moveTo(PICTURE.line.from[0] * scale, PICTURE.line.from[1] * scale); g.lineTo(PICTURE.line.to[0] * scale, PICTURE.line.to[1] * scale); g.stroke();
  }
  drawKnowledge(g, scale, strip, width, height);
}

/** Beside the rows and below the columns: how well each tells motion. */
function drawKnowledge(g, scale, strip, width, height) {
  const part = PICTURE.part;
  if (!part || !PICTURE.aim) return;
  const along = (list, place) => list.forEach((sd, k) => {
    const [from, to] = [k / list.length, (k + 1) / list.length];
    g.fillStyle = sd === null ? style("--line") : heat(1.15 - Math.min(1, Math.max(0.05, sd / 3)));
    place(from, to);
  });
  along(PICTURE.aim.rows, (a, b) => g.fillRect(width + 3, (part[1] + a * part[3]) * scale, strip - 4, (b - a) * part[3] * scale + 0.5));
  along(PICTURE.aim.columns, (a, b) => g.fillRect((part[0] + a * part[2]) * scale, height + 3, (b - a) * part[2] * scale + 0.5, strip - 4));
}

function showAim(aim, report) {
  PICTURE.aim = aim;
  $("meters").hidden = !aim;
  if (!aim) return;
  PICTURE.bestFocus = Math.max(PICTURE.bestFocus, aim.focus);
  $("focus").textContent = digits(aim.focus, 3);
  const bar = canvas("focus-bar");
  bar.g.fillStyle = style("--faint");
  bar.g.fillRect(0, 8, bar.width, 14);
  bar.g.fillStyle = style("--x");
  bar.g.fillRect(0, 8, (bar.width * aim.focus) / (PICTURE.bestFocus * 1.05 || 1), 14);
  bar.g.fillStyle = style("--text");
  bar.g.fillRect(bar.width / 1.05 - 1, 4, 2, 22);
  $("light").textContent = `${Math.round(aim.mean)} %`;
  $("light").className = aim.bright > 10 || aim.mean < 8 ? "look" : "";
  $("light-note").textContent = aim.bright > 10 ? "light: too bright" : aim.mean < 8 ? "light: too dark" : aim.bright >= 0.05 ? `light, ${digits(aim.bright, 2)} % white` : "light";
  const light = canvas("light-bar");
  const most = Math.max(...aim.histogram);
  const step = light.width / aim.histogram.length;
  aim.histogram.forEach((share, k) => {
    light.g.fillStyle = style(k === aim.histogram.length - 1 ? "--bad" : "--soft");
    const tall = Math.max(share > 0 ? 1 : 0, (share / most) * 26);
    light.g.fillRect(k * step, 28 - tall, Math.max(1, step - 1), tall);
  });
  light.g.fillStyle = style("--line");
  light.g.fillRect(0, 28, light.width, 1);
  const known = aim.rows.filter((sd) => sd !== null).length;
  const rows = known === aim.rows.length ? "all rows know something" : `${Math.round((100 * known) / aim.rows.length)} % of the rows know something`;
  const noise = report ? `: ${digits(report.noise_px, 2)} px a row` : "";
  $("picture-note").textContent = `${PICTURE.size.join(" × ")} px, ${rows}${noise}`;
}

/** Where the pointer is, in whole pixels of the picture. */
function pictureAt(event) {
  const { scale } = pictureScale();
  const box = $("picture").getBoundingClientRect();
  const clamp = (v, most) => Math.round(Math.min(most, Math.max(0, v)));
  return [clamp((event.clientX - box.left) / scale, PICTURE.size[0]), clamp((event.clientY - box.top) / scale, PICTURE.size[1])];
}

function choose(part) {
  PICTURE.wanted = part;
  $("use-part").hidden = !part;
  $("part-hint").textContent = part ? `x ${part[0]}, y ${part[1]}, ${part[2]} × ${part[3]} px; Esc leaves it` : PICTURE.line ? "draw a line of known length in the picture" : "drag to choose a part";
  drawPicture();
}

function listenToPicture() {
  const element = $("picture");
  element.addEventListener("pointerdown", (event) => {
    if (!PICTURE.size || !PICTURE.changeable) return;
    element.setPointerCapture(event.pointerId);
    PICTURE.start = pictureAt(event);
    if (PICTURE.line) PICTURE.line = { from: PICTURE.start, to: null };
  });
  element.addEventListener("pointermove", (event) => {
    if (!PICTURE.start) return;
    const [a, b] = [PICTURE.start, pictureAt(event)];
    if (PICTURE.line) { PICTURE.line.to = b; drawPicture(); return; }
    const part = [Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.abs(a[0] - b[0]), Math.abs(a[1] - b[1])];
    if (part[2] > 2 && part[3] > 2) choose(part);
  });
  element.addEventListener("pointerup", () => {
    PICTURE.start = null;
    if (PICTURE.line?.to) askLength();
  });
  element.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (event.key === "Escape") { PICTURE.line = null; choose(null); }
    if (event.key === "Enter" && PICTURE.wanted) $("use-part").click();
    if (!step || !PICTURE.size || !PICTURE.changeable) return;
    event.preventDefault();
    const [width, height] = PICTURE.size;
    let [x, y, w, h] = PICTURE.wanted ?? PICTURE.part ?? [0, 0, width, height];
    const by = Math.max(1, Math.round(width / 64));
    // With Shift the size, else the place.
    if (event.shiftKey) [w, h] = [w + by * step[0], h + by * step[1]];
    else [x, y] = [x + by * step[0], y + by * step[1]];
    w = Math.min(width, Math.max(16, w)); h = Math.min(height, Math.max(1, h));
    choose([Math.min(width - w, Math.max(0, x)), Math.min(height - h, Math.max(0, y)), w, h]);
  });
  $("use-part").addEventListener("click", async () => {
    if (await change({ roi: PICTURE.wanted })) choose(null);
  });
  $("whole-part").addEventListener("click", async () => {
    if (await change({ roi: [0, 0, ...PICTURE.size] })) choose(null);
  });
  $("scale").addEventListener("click", () => {
    PICTURE.line = { from: null, to: null };
    choose(null);
    element.focus();
  });
}

/** A line was drawn: its length gives the scale. */
function askLength() {
  const { from, to } = PICTURE.line;
  const px = Math.hypot(to[0] - from[0], to[1] - from[1]);
  const done = () => { PICTURE.line = null; choose(null); };
  if (px < 5) return done();
  $("length-text").textContent = `It is ${px.toFixed(1)} px long in the picture. The object must lie in the plane that vibrates.`;
  const dialog = $("length");
  dialog.returnValue = "cancel";
  dialog.onclose = async () => {
    const mm = Number($("length-input").value.replace(",", "."));
    done();
    if (dialog.returnValue === "ok" && mm > 0) await change({ "um-per-px": +((1000 * mm) / px).toPrecision(5) });
  };
  dialog.showModal();
}
