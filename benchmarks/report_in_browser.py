"""Open a report in a headless Chromium, as a reader would, and check it.

It measures how long the page takes to open, and checks for faults, whether it fits a phone, and whether its replay
plays and turns.  It also takes pictures to look at.

    python benchmarks/report_in_browser.py report.html pictures/

It exits with 1 where a check fails, and needs only ``chromium`` on the path, to which it talks through a pipe.
"""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

OPEN_WITHIN = 2.0
"""s; a waiting time that a reader does not notice."""
DESKTOP, PHONE = (1280, 900, 1.0, False), (390, 844, 2.0, True)
"""Width, height, pixels a point, touch."""

ALL_IN_MID_RUN = """for (const box of document.querySelectorAll('.replay')) {
  box.querySelector('[name=view]').dispatchEvent(new Event('change'));
  const slider = box.querySelector('[name=time]');
  slider.value = 0.56;
  slider.dispatchEvent(new Event('input'));
} 0"""

DRAWN = """(() => {
  const canvas = box.querySelector('canvas'), style = getComputedStyle(box), seen = new Set();
  const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
  for (let i = 0; i < data.length; i += 4) seen.add((data[i] << 16) | (data[i + 1] << 8) | data[i + 2]);
  const missing = ['head', 'trunk', 'c1', 'c2', 'c3', 'ink', 'path', 'grid'].filter(
    (name) => !seen.has(parseInt(style.getPropertyValue(`--${name}`).trim().slice(1), 16)));
  return missing.join(' ');
})()"""
"""Colours of the replay that its picture lacks: head, trunk, right, left, snow's force, weight, path, grid."""


class Browser:
    """One Chromium, one page, the DevTools protocol over file descriptors 3 and 4."""

    def __init__(self, program: str, profile: str) -> None:
        theirs_in, self._out = os.pipe()
        self._in, theirs_out = os.pipe()
        command = [
            program,
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            f"--user-data-dir={profile}",
            "--remote-debugging-pipe",
            "about:blank",
        ]

        self._process = subprocess.Popen(
            ["sh", "-c", f'exec "$@" 3<&{theirs_in} 4>&{theirs_out}', "sh", *command],
            pass_fds=(theirs_in, theirs_out),
            stderr=subprocess.DEVNULL,
        )
        os.close(theirs_in)
        os.close(theirs_out)
        self._rest = b""
        self._count = 0
        self.events: list[dict[str, Any]] = []
        self._session = ""
        pages = [entry for entry in self.call("Target.getTargets")["targetInfos"] if entry["type"] == "page"]
        self._session = self.call("Target.attachToTarget", targetId=pages[0]["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send one command and return its answer."""
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == self._count:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                result: dict[str, Any] = answer["result"]
                return result
            self.events.append(answer)

    def wait(self, event: str) -> None:
        """Wait until the event has come."""
        while not any(seen.get("method") == event for seen in self.events):
            self.events.append(self._read())

    def value(self, expression: str) -> Any:
        """Return the value of JavaScript in the page."""
        answer = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(answer["exceptionDetails"]["exception"]["description"])
        return answer["result"].get("value")

    def screen(self, width: int, height: int, scale: float, touch: bool, dark: bool = False) -> None:
        """Emulate a screen of that size and theme."""
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=touch
        )
        self.call("Emulation.setTouchEmulationEnabled", enabled=touch)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])

    def open(self, page: Path) -> float:
        """Load a page and return the seconds until it was drawn."""
        self.events.clear()
        began = time.perf_counter()
        self.call("Page.navigate", url=page.resolve().as_uri())
        self.wait("Page.loadEventFired")
        self.value("new Promise((done) => requestAnimationFrame(() => setTimeout(done, 0)))")
        return time.perf_counter() - began

    def picture(self, path: Path, whole: bool = True) -> None:
        """Write a PNG of the page, or of the screen."""
        shot = self.call("Page.captureScreenshot", captureBeyondViewport=whole, format="png")
        path.write_bytes(base64.b64decode(shot["data"]))

    def printed(self, path: Path) -> None:
        """Write the page as it prints."""
        document = self.call("Page.printToPDF", printBackground=False, preferCSSPageSize=True)
        path.write_bytes(base64.b64decode(document["data"]))

    def faults(self) -> list[str]:
        """Return exceptions, errors and refusals that the page met, and its requests to a network."""
        faults = []
        for event in self.events:
            parameters = event.get("params", {})
            match event.get("method"):
                case "Runtime.exceptionThrown":
                    faults.append(str(parameters["exceptionDetails"].get("exception", parameters["exceptionDetails"])))
                case "Log.entryAdded" if parameters["entry"]["level"] in ("error", "warning"):
                    faults.append(parameters["entry"]["text"])
                case "Network.requestWillBeSent" if not parameters["request"]["url"].startswith(("file:", "data:")):
                    faults.append(f"requested {parameters['request']['url']}")
        return faults

    def close(self) -> None:
        """End the browser."""
        self._session = ""
        self.call("Browser.close")
        self._process.wait(timeout=20)

    def _read(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            chunk = os.read(self._in, 1 << 20)
            if not chunk:
                raise RuntimeError("the browser went away")
            self._rest += chunk
        message, _, self._rest = self._rest.partition(b"\0")
        answer: dict[str, Any] = json.loads(message)
        return answer


def replay_works(browser: Browser) -> dict[str, bool]:
    """Play, scrub, orbit by mouse and by keys: each has to change the picture."""
    browser.value("window.box = document.querySelector('.replay'); box.scrollIntoView(); 0")
    look = "box.querySelector('canvas').toDataURL().length + box.querySelector('canvas').toDataURL().slice(-4000)"
    place = browser.value("(({x, y, width, height}) => [x + width / 2, y + height / 2])(box.querySelector('canvas')"
                          ".getBoundingClientRect())")  # fmt: skip
    done = {}
    before = browser.value(look)
    slider = "box.querySelector('[name=time]')"
    browser.value(f"{slider}.value = 0.5; {slider}.dispatchEvent(new Event('input')); 0")
    after = browser.value(look)
    done["scrub"], before = before != after, after
    done["everything drawn"] = browser.value(DRAWN) == ""
    browser.value("box.querySelector('[name=play]').click(); new Promise((done) => setTimeout(done, 400))")
    browser.value("box.querySelector('[name=play]').click()")
    after = browser.value(look)
    done["play"], before = before != after and browser.value(f"{slider}.value > 0.5"), after
    for kind, x in (("mousePressed", 0), ("mouseMoved", 80), ("mouseReleased", 80)):
        browser.call(
            "Input.dispatchMouseEvent", type=kind, x=place[0] + x, y=place[1], button="left", buttons=1, clickCount=1
        )
    after = browser.value(look)
    done["orbit by mouse"], before = before != after, after
    browser.value("box.querySelector('canvas').dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowUp'})); 0")
    after = browser.value(look)
    done["orbit by keys"] = before != after
    return done


def played_together(browser: Browser) -> bool:
    """Tell whether the button of several replays moves them all, by the same time."""
    browser.value("document.querySelector('.together button').click(); new Promise((done) => setTimeout(done, 500))")
    browser.value("document.querySelector('.together button').click()")
    seconds = browser.value(
        "[...document.querySelectorAll('.replay')].map((box) => {"
        " const data = JSON.parse(box.querySelector('script').textContent);"
        " return box.querySelector('[name=time]').value * (data.frames - 1) / data.rate; })"
    )
    return bool(min(seconds) > 0.1 and max(seconds) - min(seconds) < 1e-6)


def touched(browser: Browser) -> bool:
    """Tell whether a finger turns the replay."""
    look = "document.querySelector('.replay canvas').toDataURL().slice(-4000)"
    browser.value("document.querySelector('.replay').scrollIntoView()")
    x, y = browser.value("(({x, y, width, height}) => [x + width / 2, y + height / 2])(document"
                         ".querySelector('.replay canvas').getBoundingClientRect())")  # fmt: skip
    before = browser.value(look)
    browser.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
    browser.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=[{"x": x + 60, "y": y + 10}])
    browser.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    return bool(before != browser.value(look))


def main() -> int:
    page, pictures = Path(sys.argv[1]), Path(sys.argv[2])
    pictures.mkdir(parents=True, exist_ok=True)
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        sys.exit("no chromium on the path")
    checks: dict[str, bool] = {}
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(program, profile)
        for name, size, dark in (("desktop", DESKTOP, False), ("dark", DESKTOP, True), ("phone", PHONE, False)):
            browser.screen(*size, dark=dark)
            seconds = browser.open(page)
            print(f"{name}: open after {seconds:.2f} s, {page.stat().st_size / 1e6:.2f} MB")
            checks[f"{name} opens within {OPEN_WITHIN} s"] = seconds < OPEN_WITHIN
            wide = browser.value("document.documentElement.scrollWidth - document.documentElement.clientWidth")
            checks[f"{name} has nothing outside the screen"] = wide <= 0
            browser.picture(pictures / f"{name}.png")
            if browser.value("document.querySelectorAll('.replay').length > 1"):
                checks[f"{name}: played together"] = played_together(browser)
            if browser.value("document.querySelector('.replay') !== null"):
                checks |= {f"{name}: {what}": well for what, well in replay_works(browser).items()}
                if name == "phone":
                    checks["orbit by touch"] = touched(browser)
                browser.value(ALL_IN_MID_RUN)
                browser.picture(pictures / f"{name}-replay.png", whole=False)
            for fault in browser.faults():
                print(f"{name}: {fault}")
                checks[f"{name} without faults"] = False
        browser.printed(pictures / "print.pdf")
        browser.close()
    for what, well in checks.items():
        print("ok  " if well else "FAIL", what)
    return 0 if all(checks.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
