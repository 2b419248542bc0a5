"""Pages in a headless browser. No test lives here."""

from __future__ import annotations

import base64
import fcntl
import json
import os
import select
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import pytest

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
#: Set to anything, it makes tests fail rather than skip where there is no browser.
NEEDED = "CURVIFY_TEST_BROWSER"
SETTINGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--force-device-scale-factor=1",
)
#: Seconds that a page may take to answer.
PATIENCE = 20.0


def browser_or_skip() -> str:
    """The name of a browser; the test is skipped where there is none, unless the environment forbids that."""
    found = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if found is None and os.environ.get(NEEDED):
        raise AssertionError(f"no browser: none of {', '.join(PROGRAMS)} is installed")
    if found is None:
        pytest.skip(f"no browser: install chromium to test pages ({', '.join(PROGRAMS)} were looked for)")
    return found


def screenshot(page: Path, picture: Path, size: tuple[int, int], tries: int = 3) -> None:
    """Take a picture of a page. A browser that hangs, as it does now and then on a loaded machine, is asked again; the
    test is skipped if it hangs each time, unless the environment forbids that.
    """
    for attempt in range(tries):
        profile = picture.with_suffix(f".profile{attempt}")
        line = [browser_or_skip(), *SETTINGS, f"--user-data-dir={profile}", f"--window-size={size[0]},{size[1]}"]
        told = _run([*line, "--virtual-time-budget=10000", f"--screenshot={picture}", page.as_uri()], 30)
        shutil.rmtree(profile, ignore_errors=True)
        if told is not None:
            assert picture.exists(), told[-2000:]
            return
    give_up(f"the browser hung {tries} times")


def give_up(why: str) -> NoReturn:
    """Skip the test, or fail where the environment says so."""
    if os.environ.get(NEEDED):
        raise AssertionError(why)
    pytest.skip(why)


@contextmanager
def touched_browser(profile: Path) -> Iterator[Browser]:
    """A browser that is told what to do through a pipe: it reads requests from file 3 and answers to file 4."""
    program = browser_or_skip()
    asked, ask = os.pipe()
    hear, told = os.pipe()
    line = [program, *SETTINGS, f"--user-data-dir={profile}", "--remote-debugging-pipe", "about:blank"]
    ends = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10) for end in (asked, told)]  # out of the way of 3 and 4

    def connect() -> None:
        for place, end in enumerate(ends, start=3):
            os.dup2(end, place)

    process = subprocess.Popen(
        line,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        close_fds=False,  # those of this process close by themselves
        preexec_fn=connect,
        start_new_session=True,
    )
    for end in (asked, told, *ends):
        os.close(end)
    try:
        yield Browser(ask, hear)
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        os.close(ask)
        os.close(hear)
        shutil.rmtree(profile, ignore_errors=True)


class Browser:
    """Requests of the DevTools protocol and their answers, each ended by a zero byte. What the pages are sent counts as
    done by a person: their events are trusted.
    """

    def __init__(self, ask: int, hear: int) -> None:
        self.ask, self.hear = ask, hear
        self.number, self.rest = 0, b""

    def __call__(self, method: str, session: str | None = None, **values: Any) -> dict[str, Any]:
        """Ask for something and wait for the answer."""
        self.number += 1
        request = {"id": self.number, "method": method, "params": values}
        os.write(self.ask, json.dumps(request | ({"sessionId": session} if session else {})).encode() + b"\0")
        end = time.monotonic() + PATIENCE
        while True:
            answer = self._next(end, method)
            if answer.get("id") == self.number:
                assert "error" not in answer, answer
                return answer["result"]

    def _next(self, end: float, method: str) -> dict[str, Any]:
        while b"\0" not in self.rest:
            if not select.select([self.hear], [], [], max(end - time.monotonic(), 0))[0]:
                give_up(f"the browser did not answer {method}")
            self.rest += os.read(self.hear, 1 << 16)
        first, self.rest = self.rest.split(b"\0", 1)
        return json.loads(first)

    def open(self, address: str, size: tuple[int, int]) -> Page:
        """A page on a touch screen, once it shows something."""
        target = self("Target.createTarget", url="about:blank")["targetId"]
        page = Page(self, self("Target.attachToTarget", targetId=target, flatten=True)["sessionId"])
        page("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=False)
        page("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=5)
        page("Page.navigate", url=address)
        page.wait_for("document.readyState == 'complete' && !!document.getElementById('facts')?.textContent")
        return page


class Page:
    """A page of a browser."""

    def __init__(self, browser: Browser, session: str) -> None:
        self.browser, self.session = browser, session

    def __call__(self, method: str, **values: Any) -> dict[str, Any]:
        """Ask for something on this page."""
        return self.browser(method, self.session, **values)

    def value(self, expression: str) -> Any:
        """The value of some JavaScript."""
        answer = self("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        return answer["result"].get("value")

    def wait_for(self, condition: str) -> None:
        """Wait until some JavaScript is true."""
        end = time.monotonic() + PATIENCE
        while not self.value(condition):
            if time.monotonic() > end:
                give_up(f"the page did not come to {condition}")
            time.sleep(0.02)

    def touch(self, *fingers: list[tuple[float, float]]) -> None:
        """Put fingers down, move each along its places ``[(x, y), ...]``, and lift them."""

        def points(step: int) -> list[dict[str, float]]:
            return [{"x": places[step][0], "y": places[step][1], "id": k} for k, places in enumerate(fingers)]

        self("Input.dispatchTouchEvent", type="touchStart", touchPoints=points(0))
        for step in range(1, len(fingers[0])):
            self("Input.dispatchTouchEvent", type="touchMove", touchPoints=points(step))
        self("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def picture(self) -> bytes:
        """The PNG picture of what the page shows now."""
        self.value("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")
        return base64.b64decode(self("Page.captureScreenshot", format="png")["data"])


def _run(line: list[str], seconds: float) -> str | None:
    """What a program writes to standard error; None if it hangs: then it is ended with all that it started."""
    process = subprocess.Popen(
        line, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        return process.communicate(timeout=seconds)[1]
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return None
