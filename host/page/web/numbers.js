// ---- Numbers and elements ----

const $ = (id) => document.getElementById(id);

/** A number with so many significant digits and never an exponent where it has a sensible size. */
function digits(value, count) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const magnitude = Math.floor(Math.log10(Math.abs(value)));
  if (magnitude < -6) return value.toExponential(count - 1);
  return value.toFixed(Math.min(20, Math.max(0, count - 1 - magnitude)));
}

/** A value with decimals down to the first digit of its standard deviation. */
function measured(value, sd) {
  if (!Number.isFinite(value)) return "–";
  if (!(sd > 0)) return digits(value, 4);
  return value.toFixed(Math.min(6, Math.max(0, -Math.floor(Math.log10(sd)))));
}

/** The next 1, 2 or 5 times a power of ten. */
function roundStep(atLeast) {
  const power = 10 ** Math.floor(Math.log10(atLeast));
  return [1, 2, 5, 10].find((m) => m * power >= atLeast * 0.999) * power;
}

function element(name, text, className) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

/** A big figure with its unit. */
function figure(id, text, unit) {
  const to = $(id);
  to.textContent = text;
  if (unit) to.append(element("small", unit));
}

const count = (value) => Math.round(value).toLocaleString("en").replaceAll(",", "\u202f");

function duration(seconds) {
  if (seconds < 90) return `${Math.round(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  if (seconds < 172800) return `${(seconds / 3600).toFixed(1)} h`;
  return `${(seconds / 86400).toFixed(1)} days`;
}
