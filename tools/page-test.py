#!/usr/bin/env python3
"""The page in a real browser: Debian's chromium, without a screen, spoken to over its DevTools pipe.

    tools/page-test.py [--rowtone target/release/rowtone] [--shots FOLDER]

Simulates a clip, serves it, and looks whether the page draws its tones, measures a part that is dragged, refuses a
wrong setting with its reason, works where events are blocked, asks for a password where it must, and says nothing on
the browser's console. With --shots it writes page-1280x800.png and page-390x844.png, which stand in docs/.
Exit status 1, and what differed, where anything does.
"""

import argparse, base64, json, os, re, subprocess, sys, tempfile, time

TONES = [(24.7, 0.3), (49.4, 0.08), (187.4, 0.04), (317.6, 0.015)]
CAMERA = ["--line-time-us", "40", "--exposure-us", "500"]


class Browser:
    """One page of a chromium, over the pipe of --remote-debugging-pipe: JSON and a NUL each way."""

    def __init__(self, folder):
        ours, theirs = os.pipe(), os.pipe()
        def child():
            os.dup2(ours[0], 3), os.dup2(theirs[1], 4)
        command = ["chromium", "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run",
                   f"--user-data-dir={folder}", "--remote-debugging-pipe", "about:blank"]
        # Copies beyond 3 and 4 are closed in the child.
        self.process = subprocess.Popen(command, preexec_fn=child, pass_fds=(3, 4), stderr=subprocess.DEVNULL)
        os.close(ours[0]), os.close(theirs[1])
        self.to, self.of = os.fdopen(ours[1], "wb", 0), os.fdopen(theirs[0], "rb", 0)
        self.number, self.bytes, self.session, self.errors, self.network = 0, b"", None, [], []
        target = next(t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def message(self):
        while b"\0" not in self.bytes:
            got = self.of.read(1 << 16)
            if not got:
                raise SystemExit("the browser has gone")
            self.bytes += got
        one, self.bytes = self.bytes.split(b"\0", 1)
        return json.loads(one)

    def call(self, method, **params):
        self.number += 1
        ask = {"id": self.number, "method": method, "params": params}
        if self.session:
            ask["sessionId"] = self.session
        self.to.write(json.dumps(ask).encode() + b"\0")
        while True:
            said = self.message()
            if said.get("id") == self.number:
                if "error" in said:
                    raise SystemExit(f"{method}: {said['error']}")
                return said["result"]
            self.note(said)

    def note(self, event):
        """What the console would show in red."""
        params = event.get("params", {})
        if event.get("method") == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif event.get("method") == "Log.entryAdded" and params["entry"]["level"] == "error":
            entry = params["entry"]
            # An answer that is a refusal is logged by the browser itself: listed apart.
            (self.network if entry["source"] == "network" else self.errors).append(entry["text"])
        elif event.get("method") == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.errors.append(str([a.get("value") for a in params["args"]]))

    def value(self, expression, waiting=False):
        result = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in result:
            if waiting:  # for a page that is not there yet
                return None
            raise SystemExit(f"{expression}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def wait(self, expression, what, seconds=30):
        end = time.time() + seconds
        while time.time() < end:
            found = self.value(expression, waiting=True)
            if found:
                return found
            time.sleep(0.1)
        raise SystemExit(f"{what}: not within {seconds} s; console: {self.errors}")

    def open(self, url, width, height, phone=False):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=2 if phone else 1, mobile=phone)
        self.call("Page.navigate", url=url)

    def drag(self, a, b):
        mouse = lambda kind, at: self.call("Input.dispatchMouseEvent", type=kind, x=at[0], y=at[1], button="left", buttons=1, clickCount=1)
        mouse("mousePressed", a)
        for k in range(1, 6):
            mouse("mouseMoved", [a[i] + (b[i] - a[i]) * k / 5 for i in (0, 1)])
        mouse("mouseReleased", b)

    def shot(self, path):
        time.sleep(0.5)
        data = self.call("Page.captureScreenshot", format="png")["data"]
        with open(path, "wb") as file:
            file.write(base64.b64decode(data))

    def close(self):
        self.process.terminate()
        self.process.wait(20)


def serve(rowtone, *args):
    """A served page: its process and its address."""
    process = subprocess.Popen([rowtone, "serve", *args, "--listen", "127.0.0.1:0"], stderr=subprocess.PIPE, text=True)
    line = process.stderr.readline()
    found = re.search(r"http://[^ ]+", line)
    if not found:
        raise SystemExit(f"no page: {line}")
    return process, found.group()


def check(what, good, *seen):
    print(("ok    " if good else "WRONG ") + what, *([] if good else seen), flush=True)
    check.wrong |= not good


check.wrong = False


def tones(browser, what):
    peaks = browser.value("document.body.dataset.peaks")
    shown = sorted(float(hz) for hz in peaks.split(","))
    wanted = sorted(hz for hz, _ in TONES)
    near = len(shown) == len(wanted) and all(abs(a - b) < 0.05 for a, b in zip(shown, wanted))
    check(f"{what}: draws the simulated tones", near, shown, wanted)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--rowtone", default="target/release/rowtone")
    parser.add_argument("--shots", metavar="FOLDER")
    parser.add_argument("--whole", metavar="FILE.png", help="all of the page, scrolled or not")
    parser.add_argument("--dark", action="store_true", help="as for those who prefer it dark")
    args = parser.parse_args()
    ended = "DATA.state?.phase === 'ended' && document.body.dataset.peaks"
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        clip = f"{folder}/press.y4m"
        tone_args = [word for hz, px in TONES for word in ("--tone", f"{hz}:{px}")]
        subprocess.run([args.rowtone, "simulate", "--seconds", "8", *tone_args, "-o", clip], check=True, stderr=subprocess.DEVNULL)
        rules = f"{folder}/rules.toml"
        with open(rules, "w") as file:  # 0.3 px are 36 um
            file.write('[[alarm]]\nname = "press"\nquantity = "tone"\nhz = 24.7\nunit = "um"\nwarning = 30\ntrip = 50\n')
        page, url = serve(args.rowtone, clip, *CAMERA, "--um-per-px", "120", "--hop", "0.25", "--alarms", rules)
        browser = Browser(f"{folder}/profile")
        scheme = {"name": "prefers-color-scheme", "value": "dark" if args.dark else "light"}
        browser.call("Emulation.setEmulatedMedia", features=[scheme])
        try:
            browser.open(url, 1280, 800)
            browser.wait(ended, "the tones")
            browser.wait("PICTURE.bitmap && DATA.curve", "the picture")
            tones(browser, "1280x800")
            rows = browser.value("document.querySelectorAll('#peaks tr').length")
            check("the table has a row a tone", rows == len(TONES), rows)
            drawn = "(id) => { const c = document.getElementById(id); return new Set(new Uint32Array(c.getContext('2d').getImageData(0, 0, c.width, c.height).data.buffer)).size; }"
            for chart in ("picture", "spectrum", "motion", "orbit", "waterfall", "trend"):
                colours = browser.value(f"({drawn})('{chart}')")
                check(f"{chart} is drawn", colours > 3, colours)
            row = browser.value("[...document.querySelectorAll('#alarms td')].map((cell) => cell.textContent)")
            check("the alarm is shown", row[:2] == ["press", "warning"] and row[3:] == ["30.0", "50.0", "µm"], row)
            phases = browser.value("[...document.querySelectorAll('#peaks tr')].map((row) => row.querySelectorAll('td.wide').length && row.querySelectorAll('td.wide')[3].textContent)")
            check("each tone has its phase", len(phases) == len(TONES) and abs(float(phases[0])) < 5, phases)
            if args.shots:
                browser.shot(f"{args.shots}/page-1280x800.png")
            if args.whole:
                browser.call("Emulation.setDeviceMetricsOverride", width=1280, height=1700, deviceScaleFactor=1, mobile=False)
                browser.shot(args.whole)
                browser.call("Emulation.setDeviceMetricsOverride", width=1280, height=800, deviceScaleFactor=1, mobile=False)
            wide = browser.value("document.documentElement.scrollWidth")
            check("nothing sticks out at 1280 px", wide <= 1280, wide)

            # The shapes: all of this picture moves alike.
            browser.value("document.getElementById('shapes-show').click()")
            browser.wait("chosenShape()?.largest > 0", "the shapes", 60)
            hz, moving, known, largest = browser.value("(() => { const { shape, largest } = chosenShape(); return [shape.hz, shape.moves.filter(Boolean).length, shape.x.filter((x) => x).length, largest]; })()")
            check("the strongest tone's shape is shown", abs(hz - TONES[0][0]) < 0.2 and moving >= 0.9 * known and abs(largest - 0.3) < 0.05, hz, moving, known, largest)
            time.sleep(0.3)
            colours = browser.value(f"({drawn})('shapes')")
            check("shapes are drawn", colours > 10, colours)
            if args.shots:
                browser.value("document.getElementById('shapes-card').scrollIntoView()")
                browser.shot(f"{args.shots}/page-shapes.png")
                browser.value("scrollTo(0, 0)")
            browser.value("document.getElementById('shapes-show').click()")

            # A part that is dragged is measured.
            box = browser.value("(() => { const b = document.getElementById('picture').getBoundingClientRect(), s = pictureScale().scale; return [b.left, b.top, s]; })()")
            at = lambda x, y: [box[0] + x * box[2], box[1] + y * box[2]]
            browser.drag(at(16, 40), at(112, 240))
            browser.value("document.getElementById('use-part').click()")
            browser.wait(f"{ended} && newest()?.roi?.[0] > 0", "the dragged part")
            roi = browser.value("newest().roi")
            near = all(abs(a - b) <= 3 for a, b in zip(roi, [16, 40, 96, 200]))
            check("a dragged part is measured", near, roi)
            tones(browser, "the part")

            # A wrong setting is refused with its reason, beside its field, and nothing changes.
            check("no word on the console before", not browser.network, browser.network)
            browser.value("(() => { const i = document.getElementById('set-window'); i.value = '99999'; i.form.requestSubmit(); })()")
            why = browser.wait("document.getElementById('error-window').textContent", "the reason")
            check("a wrong setting is refused with its reason", "give 0.05 to" in why, why)
            check("and is marked", browser.value("document.getElementById('set-window').getAttribute('aria-invalid')") == "true")
            check("and changes nothing", browser.value("json('/api/settings').then((s) => s.settings.window)") == 1)
            browser.network.clear()  # the browser's own note of that refusal

            # By keyboard alone: the part moves, and Escape leaves it.
            key = lambda name: [browser.call("Input.dispatchKeyEvent", type=kind, key=name) for kind in ("keyDown", "keyUp")]
            browser.value("document.getElementById('picture').focus()")
            key("ArrowRight")
            moved = browser.value("PICTURE.wanted")
            check("arrow keys move the part", moved and moved[0] > roi[0], moved)
            key("Escape")
            check("Escape leaves it", browser.value("PICTURE.wanted") is None)

            browser.open(url, 390, 844, phone=True)
            browser.wait(ended, "the tones on a phone")
            browser.wait("PICTURE.bitmap && DATA.curve", "the picture on a phone")
            tones(browser, "390x844")
            wide = browser.value("document.documentElement.scrollWidth")
            check("nothing sticks out at 390 px", wide <= 390, wide)
            if args.shots:
                browser.shot(f"{args.shots}/page-390x844.png")

            # Where events are blocked the page polls.
            browser.call("Page.addScriptToEvaluateOnNewDocument", source="window.EventSource = class { addEventListener() {} close() {} };")
            browser.open(url, 1280, 800)
            browser.wait(ended, "the tones without events")
            tones(browser, "without events")
            check("no error on the console", not browser.errors and not browser.network, browser.errors, browser.network)

            # The page as one file, with what was measured in it.
            still = f"{folder}/press.html"
            subprocess.run([args.rowtone, "analyze", clip, *CAMERA, "--report", still], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            browser.open(f"file://{still}", 1280, 800)
            browser.wait(ended, "the tones of the file")
            browser.wait("!!PICTURE.bitmap", "the picture of the file")
            tones(browser, "the file")
            check("the file asks for nothing", not browser.network and not browser.errors, browser.errors, browser.network)

            # With a password: the first change sets it.
            page.terminate(), page.wait(20)
            page, url = serve(args.rowtone, clip, *CAMERA, "--password-file", f"{folder}/password")
            browser.open(url, 1280, 800)
            browser.wait(ended, "the tones of the second page")
            browser.value("void change({ 'um-per-px': 50 })")
            browser.wait("document.getElementById('password').open", "the question for a password")
            browser.value("(() => { document.getElementById('password-input').value = 'open sesame'; document.querySelector('#password button.main').click(); })()")
            browser.wait(f"{ended} && newest()?.peaks[0]?.amplitude_um > 0", "the scale", 40)
            check("the first change sets the password", "sesame" not in open(f"{folder}/password").read())
            check("no exception", not browser.errors, browser.errors)
        finally:
            browser.close()
            page.terminate(), page.wait(20)
    sys.exit(check.wrong)


main()
