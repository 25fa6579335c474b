// ---- Shapes: a mesh over the last picture that swings at the true phase, slowed and enlarged ----

const SHAPES = { all: null, chosen: 0, shown: false, error: "" };
/** A period is shown in so many seconds. */
const SWING_S = 2;

/** The larger semi-axis of a tile's orbit, px. */
function semiMajor(x, y) {
  const [a, b, c, d] = [...(x ?? [0, 0]), ...(y ?? [0, 0])];
  return Math.sqrt((a * a + b * b + c * c + d * d + Math.hypot(a * a - b * b + c * c - d * d, 2 * (a * b + c * d))) / 2);
}

/** The chosen shape, and how far its largest tile moves. */
function chosenShape() {
  const shape = SHAPES.all?.shapes[Math.min(SHAPES.chosen, SHAPES.all.shapes.length - 1)];
  if (!shape) return null;
  const amplitudes = shape.moves.map((moves, k) => (moves ? semiMajor(shape.x[k], shape.y[k]) : 0));
  return { shape, amplitudes, largest: Math.max(0, ...amplitudes) };
}

function drawShapes() {
  if (!SHAPES.shown) return;
  requestAnimationFrame(drawShapes);
  const chosen = chosenShape();
  if (!chosen || document.hidden) return;
  const { shape, amplitudes, largest } = chosen;
  const [width, height] = SHAPES.all.size;
  const box = $("shapes-box").getBoundingClientRect();
  const scale = Math.min(box.width / width, (innerWidth > 640 ? 460 : 300) / height);
  $("shapes").style.width = `${width * scale}px`;
  $("shapes").style.height = `${height * scale}px`;
  const { g } = canvas("shapes");
  g.fillStyle = "#444";
  g.fillRect(0, 0, width * scale, height * scale);
  if (PICTURE.bitmap) g.drawImage(PICTURE.bitmap, 0, 0, width * scale, height * scale);
  if (!largest) return;
  const enlarged = (0.9 * shape.tile) / largest;
  const turn = ((performance.now() / 1000 / SWING_S) % 1) * 2 * Math.PI;
  const at = (value) => (value ? value[0] * Math.cos(turn) - value[1] * Math.sin(turn) : 0) * enlarged;
  const rest = (k) => [((k % shape.cols) + 0.5) * shape.tile * scale, (Math.floor(k / shape.cols) + 0.5) * shape.tile * scale];
  const here = (k) => { const [x, y] = rest(k); return [x + at(shape.x[k]) * scale, y + at(shape.y[k]) * scale]; };
  const line = (from, to, colour, wide) => {
    g.strokeStyle = colour; g.lineWidth = wide;
    g.beginPath(); g.moveTo(...from); g.lineTo(...to); g.stroke();
  };
  amplitudes.forEach((own, k) => {
    if (!shape.moves[k]) return;
    line(rest(k), here(k), "#fff", 1);
    const neighbours = [(k + 1) % shape.cols ? k + 1 : -1, k + shape.cols];
    for (const to of neighbours) {
      if (shape.moves[to]) line(here(k), here(to), `hsl(${250 - (200 * (own + amplitudes[to])) / 2 / largest} 95% 55%)`, 2);
    }
  });
}

function nameShapes() {
  const chosen = chosenShape();
  const tones = SHAPES.shown ? (SHAPES.all?.shapes ?? []) : [];
  $("shapes-tones").replaceChildren($("shapes-show"), ...tones.map((shape, k) => {
    const button = element("button", `${digits(shape.hz, 5)} Hz`, shape === chosen?.shape ? "main" : "");
    button.type = "button";
    button.setAttribute("aria-pressed", shape === chosen?.shape);
    button.onclick = () => { SHAPES.chosen = k; nameShapes(); };
    return button;
  }));
  if (!SHAPES.shown) { $("shapes-note").textContent = ""; return; }
  if (!chosen) { $("shapes-note").textContent = SHAPES.error || "measuring"; return; }
  const { shape, largest } = chosen;
  const moving = shape.moves.filter(Boolean).length;
  const scale = shape.um_per_px ?? 1;
  $("shapes-note").textContent = largest
    ? `${moving} of ${shape.sd.filter((sd) => sd !== null).length} tiles move, ${digits(largest * scale, 3)} ${shape.um_per_px ? "µm" : "px"} at most; slowed ${Math.round(shape.hz * SWING_S)} times, enlarged ${Math.round((0.9 * shape.tile) / largest)} times`
    : "no tile surely moves";
}

/** Asked for only while they are shown: measuring them takes the device's time. */
async function followShapes() {
  if (!SHAPES.shown) return;
  try {
    if (!document.hidden) {
      const answer = await fetch("/api/shapes");
      const said = await answer.json();
      if (answer.ok) [SHAPES.all, SHAPES.error] = [said, ""];
      else SHAPES.error = said.error;
    }
  } catch { /* the next ones may come */ } finally { nameShapes(); setTimeout(followShapes, 3000); }
}

function listenToShapes() {
  $("shapes-show").onclick = () => {
    SHAPES.shown = !SHAPES.shown;
    $("shapes-show").textContent = SHAPES.shown ? "Hide shapes" : "Show shapes";
    $("shapes-show").setAttribute("aria-pressed", SHAPES.shown);
    $("shapes-box").hidden = !SHAPES.shown;
    nameShapes();
    if (SHAPES.shown) { followShapes(); drawShapes(); }
  };
}
