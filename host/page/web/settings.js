// ---- Settings: shown, checked by the device, changed with the password ----

const SETTINGS = { current: null, changeable: [], password: "none", known: null };

/** Name, unit, what it is, and what an empty field means. */
const FIELDS = {
  "window": ["Window", "s", "length of a window"],
  "hop": ["Hop", "s", "from one report to the next"],
  "max-peaks": ["Most tones", "", "of a report"],
  "min-hz": ["Lowest frequency", "Hz", "one period a window"],
  "max-hz": ["Highest frequency", "Hz", "as the device has it"],
  "um-per-px": ["Scale", "µm/px", "none: amplitudes in px"],
  "false-alarm": ["False alarms", "", "chance of a tone in noise alone"],
  "roi": ["Part", "px", "x, y, width, height; empty: chosen by itself"],
};

function buildSettings() {
  const form = $("settings");
  form.replaceChildren();
  for (const key of Object.keys(FIELDS).filter((key) => SETTINGS.changeable.includes(key))) {
    const [name, unit, hint] = FIELDS[key];
    const label = element("label", unit ? `${name}, ${unit}` : name);
    const input = element("input");
    Object.assign(input, { id: `set-${key}`, name: key, placeholder: hint, title: hint, autocomplete: "off" });
    if (key !== "roi") input.inputMode = "decimal";
    const error = element("em");
    error.id = `error-${key}`;
    input.setAttribute("aria-describedby", error.id);
    label.append(input, error);
    form.append(label);
  }
  const buttons = element("div", undefined, "buttons");
  const apply = element("button", "Apply", "main");
  const said = element("p");
  said.id = "settings-said";
  said.setAttribute("role", "status");
  buttons.append(apply, said);
  form.append(buttons);
}

const asText = (value) => (value === null || value === undefined ? "" : Array.isArray(value) ? value.join(", ") : String(value));

function fillSettings(all) {
  const built = SETTINGS.changeable.join() === all.changeable.join() && $("settings").children.length;
  Object.assign(SETTINGS, { current: all.settings, changeable: all.changeable, password: all.password });
  $("settings-card").hidden = !all.changeable.length;
  PICTURE.changeable = all.changeable.includes("roi");
  $("picture-buttons").hidden = !PICTURE.changeable;
  $("scale").hidden = !all.changeable.includes("um-per-px");
  $("settings-note").textContent = { none: "", asked: "changing asks for the password", unset: "the first change sets the password" }[all.password];
  if (!built) buildSettings();
  for (const key of all.changeable) {
    const input = $(`set-${key}`);
    if (input && document.activeElement !== input) input.value = asText(all.settings[key]);
  }
}

/** What the form says otherwise than what holds. */
function changes() {
  const wanted = {};
  for (const input of $("settings").querySelectorAll("input")) {
    const text = input.value.trim();
    if (text === asText(SETTINGS.current[input.name]).trim()) continue;
    const number = Number(text.replace(",", "."));
    if (text === "") wanted[input.name] = null;
    else if (input.name === "roi") wanted.roi = text.split(/[\s,;]+/).join(",");
    else wanted[input.name] = Number.isFinite(number) ? number : text;
  }
  return wanted;
}

function refuse(key, why) {
  for (const input of $("settings").querySelectorAll("input")) {
    const wrong = input.name === key;
    input.setAttribute("aria-invalid", wrong);
    $(`error-${input.name}`).textContent = wrong ? why : "";
    if (wrong) input.focus();
  }
  const said = $("settings-said");
  if (said) { said.className = ""; said.textContent = why && !(key && $(`error-${key}`)) ? why : ""; }
}

const put = (path, body, password) => fetch(path, {
  method: "PUT",
  headers: { "Content-Type": "application/json", ...(password ? { Authorization: `Basic ${btoa(String.fromCharCode(...new TextEncoder().encode(`:${password}`)))}` } : {}) },
  body: JSON.stringify(body),
});

/** Asks for the password; the one that was right is remembered until the page is left. */
function askPassword(why) {
  const dialog = $("password");
  const isNew = SETTINGS.password === "unset";
  $("password-title").textContent = isNew ? "Set a password" : "Password";
  $("password-text").textContent = isNew ? "Nobody has set one yet. Whoever changes something from now on is to know it: 8 characters or more." : "Changing something asks for the device's password.";
  $("password-error").textContent = why;
  $("password-input").value = "";
  dialog.returnValue = "cancel";
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.onclose = () => resolve(dialog.returnValue === "ok" ? $("password-input").value : null);
  });
}

/** Changes settings on the device; true where they hold now. */
async function change(wanted) {
  let why = "";
  for (;;) {
    if (SETTINGS.password !== "none" && !SETTINGS.known) {
      const given = await askPassword(why);
      if (given === null) return false;
      if (SETTINGS.password === "unset") {
        const set = await put("/api/password", { password: given });
        if (!set.ok) { why = (await set.json()).error; continue; }
        SETTINGS.password = "asked";
      }
      SETTINGS.known = given;
    }
    const answer = await put("/api/settings", wanted, SETTINGS.known);
    const said = await answer.json();
    if (answer.ok) {
      refuse(null, "");
      fillSettings(said);
      for (const input of $("settings").querySelectorAll("input")) input.value = asText(said.settings[input.name]);
      $("settings-said").className = "good";
      $("settings-said").textContent = "in use";
      return true;
    }
    if (answer.status !== 401) { refuse(said.key, said.error); return false; }
    SETTINGS.known = null;
    why = said.error;
  }
}

function listenToSettings() {
  $("settings").addEventListener("submit", (event) => {
    event.preventDefault();
    const wanted = changes();
    if (Object.keys(wanted).length) change(wanted).catch((error) => refuse(null, `the device does not answer: ${error.message}`));
  });
}
