"""Pages in a headless browser. No test lives here."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from pathlib import Path

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
    "--virtual-time-budget=10000",
)


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
        told = _run([*line, f"--screenshot={picture}", page.as_uri()], 30)
        shutil.rmtree(profile, ignore_errors=True)
        if told is not None:
            assert picture.exists(), told[-2000:]
            return
    if os.environ.get(NEEDED):
        raise AssertionError(f"the browser hung {tries} times")
    pytest.skip(f"the browser hung {tries} times")


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
