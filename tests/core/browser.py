"""A Chromium without a window, driven by the DevTools protocol over two pipes: no package is needed
for it.
"""

import base64
import json
import os
import select
import shutil
import signal
import tempfile
import time
from pathlib import Path

import pytest

# as in tools/set_up.py
NAMES = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
)
FLAGS = [
    "--headless=new",
    "--remote-debugging-pipe",
    "--no-sandbox",
    "--no-first-run",
    "--hide-scrollbars",
]
FLAGS += [
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
]
WITH_3D = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
WITHOUT_3D = ["--disable-gpu", "--disable-3d-apis"]
LONGEST = 60.0  # [s] that a page may take


def find_chromium():
    """Path of a Chromium on this machine, or None."""
    return next(filter(None, map(shutil.which, NAMES)), None)


def start_browser(**options):
    """A Browser; where there is no Chromium, the test is skipped, or fails if one is wanted."""
    chromium = find_chromium()
    if chromium is None:
        (pytest.fail if "CITYPV_NEEDS_BROWSER" in os.environ else pytest.skip)(
            "no Chromium on this machine"
        )
    return Browser(chromium, **options)


class Browser:
    """One page of a Chromium; what it asked for and complained about is kept."""

    def __init__(self, chromium, *, webgl=True, width=1200, height=900):
        import fcntl  # POSIX alone has it

        self._profile = tempfile.mkdtemp()
        (to_read, self._out), (self._in, to_write) = os.pipe(), os.pipe()
        read, write = (fcntl.fcntl(pipe, fcntl.F_DUPFD_CLOEXEC, 10) for pipe in (to_read, to_write))
        flags = [*FLAGS, *(WITH_3D if webgl else WITHOUT_3D), f"--user-data-dir={self._profile}"]
        quiet = os.open(os.devnull, os.O_WRONLY)
        actions = [
            (os.POSIX_SPAWN_DUP2, end, place)
            for end, place in ((quiet, 1), (quiet, 2), (read, 3), (write, 4))
        ]
        self._process = os.posix_spawn(
            chromium, [chromium, *flags, "about:blank"], os.environ, file_actions=actions
        )
        for pipe in (to_read, to_write, read, write, quiet):
            os.close(pipe)
        self._number, self._rest, self.requests, self.complaints = 0, b"", [], []
        self._session = None
        target = next(
            one for one in self.call("Target.getTargets")["targetInfos"] if one["type"] == "page"
        )
        attached = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")
        self.resize(width, height)

    def call(self, method, **parameters):
        """Call a method of the protocol and return its result."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        message |= {"sessionId": self._session} if self._session else {}
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == self._number:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]

    def _read(self):
        """The next message; of events, requests and complaints are kept."""
        deadline = time.monotonic() + LONGEST
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._in], [], [], max(deadline - time.monotonic(), 0))
            assert ready, "the browser does not answer"
            data = os.read(self._in, 1 << 20)
            assert data, "the browser has ended"
            self._rest += data
        text, _, self._rest = self._rest.partition(b"\0")
        message = json.loads(text)
        event, details = message.get("method"), message.get("params", {})
        if event == "Network.requestWillBeSent":
            self.requests.append(details["request"]["url"])
        elif event == "Runtime.exceptionThrown":
            self.complaints.append(
                details["exceptionDetails"].get("exception", {}).get("description", "exception")
            )
        elif event == "Log.entryAdded" and details["entry"]["level"] == "error":
            self.complaints.append(details["entry"]["text"])
        return message

    def open(self, path, link=""):
        """Open a file at a link in it, and wait until its script has filled the table or said why
        not.
        """
        self.requests.clear()
        self.complaints.clear()
        self.call("Page.navigate", url=Path(path).absolute().as_uri() + link)
        self.wait(
            "document.querySelector('#city-buildings tbody tr, #city-note:not([hidden])') !== null"
        )

    def run(self, code):
        """Value of an expression in the page, awaited if it is a promise."""
        answer = self.call(
            "Runtime.evaluate", expression=code, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, condition):
        """Wait until an expression holds."""
        deadline = time.monotonic() + LONGEST
        while not self.run(condition):
            assert time.monotonic() < deadline, condition
            time.sleep(0.02)

    def resize(self, width, height):
        """Give the page the size of a screen."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500}
        self.call("Emulation.setDeviceMetricsOverride", **size)

    def click(self, x, y):
        """Click at a place of the window."""
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def press(self, key, *, shift=False):
        """Press a key."""
        text = {"text": "\r" if key == "Enter" else key} if key == "Enter" or len(key) == 1 else {}
        codes = {"ArrowLeft": 37, "Home": 36, "Escape": 27, "Enter": 13}
        details = {"key": key, "code": key, "modifiers": 8 * shift}
        details["windowsVirtualKeyCode"] = codes.get(key, ord(key[0]))
        self.call("Input.dispatchKeyEvent", type="keyDown", **details, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", **details)

    def picture(self, path):
        """Write what the window shows as a PNG."""
        Path(path).write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))

    def print(self):
        """The page as a PDF: bytes."""
        return base64.b64decode(
            self.call("Page.printToPDF", printBackground=True, preferCSSPageSize=True)["data"]
        )

    def close(self):
        """End the browser."""
        os.kill(self._process, signal.SIGTERM)
        os.waitpid(self._process, 0)
        for pipe in (self._in, self._out):
            os.close(pipe)
        shutil.rmtree(self._profile, ignore_errors=True)
