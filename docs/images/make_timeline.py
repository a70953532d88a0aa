"""Takes the pictures of reports for the manual, and films the timeline: from real runs, in a real browser.

    python docs/images/make_timeline.py [NAME...]

Needs chromium, playwright, and Pillow for the animation (``pip install playwright pillow``): they are needed
only here. ``timeline`` is the animation of the README: a daemon runs test-scenario, and its page is filmed.
"""

from __future__ import annotations

import io
import shutil
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
DESK = {"width": 1280, "height": 800}
FILM = {"width": 960, "height": 620}
PHONE = {"width": 390, "height": 844}
FRAMES_PER_SECOND = 6
FILM_S = 13  # a bit more than the run takes
MAX_FILM_BYTES = 1_000_000  # the README loads the film
CONFIG = """%YAML 1.2
%TAG ! tag:fawkesrobotics.org,cfg/
---
cxbridge:
  web: {{enable: true, port: {port}}}
"""


def cxbridge(*arguments: object) -> None:
    """Run a command of cxbridge."""
    subprocess.run([sys.executable, "-m", "cxbridge", *map(str, arguments)], check=True, cwd=ROOT)


def record(folder: Path, scenario: str) -> Path:
    """Run a scenario, and return the recording."""
    path = folder / f"{scenario}.mcap"
    cxbridge("run", f"scenarios/{scenario}", "--trace", path, "--trace-level", "facts")
    return path


@contextmanager
def daemon(folder: Path, scenario: str) -> Iterator[str]:
    """Run a daemon, and yield the address of its page when the page can be loaded or the daemon has ended."""
    with socket.create_server(("127.0.0.1", 0)) as listener:  # finds a free port
        port = listener.getsockname()[1]
    config = folder / "web.yaml"
    config.write_text(CONFIG.format(port=port), encoding="utf-8")
    command = [sys.executable, "-m", "cxbridge", "daemon", "start", f"scenarios/{scenario}"]
    with (
        (folder / "daemon.log").open("w") as log,
        subprocess.Popen([*command, "--config", str(config)], cwd=ROOT, stdout=log, stderr=log) as process,
    ):
        url = f"http://127.0.0.1:{port}/"
        try:
            while process.poll() is None:
                try:
                    urllib.request.urlopen(url).close()
                    break
                except urllib.error.URLError:
                    time.sleep(0.05)
            yield url
        finally:
            process.terminate()


def film(browser: Any, folder: Path) -> None:
    """Film the page while goals come and go; then open the goal that has failed by its timeout.

    :raises SystemExit: if the film is too large in each quality.
    """
    from PIL import Image

    shots: list[bytes] = []
    with daemon(folder, "test-scenario") as url:
        tab = browser.new_page(viewport=FILM)
        tab.goto(url)
        begin = time.monotonic()

        def shoot(seconds: float) -> None:
            for _ in range(round(seconds * FRAMES_PER_SECOND)):
                shots.append(tab.screenshot())
                due = begin + len(shots) / FRAMES_PER_SECOND
                tab.wait_for_timeout(max(1, (due - time.monotonic()) * 1000))

        shoot(FILM_S)
        tab.click(".tl-names [role=treeitem]:has-text('gen18')")
        shoot(3)
        tab.close()
    frames = [Image.open(io.BytesIO(shot)).convert("RGB") for shot in shots]
    path = HERE / "timeline.webp"
    for quality in (80, 60, 40, 20):  # the first with which the file is small enough
        frames[0].save(
            path,
            save_all=True,
            append_images=frames[1:],
            duration=1000 // FRAMES_PER_SECOND,
            loop=0,
            quality=quality,
            method=4,
            minimize_size=True,
        )
        if path.stat().st_size < MAX_FILM_BYTES:
            return
    raise SystemExit(f"{path} is larger than {MAX_FILM_BYTES} bytes")


def take_reports(browser: Any, folder: Path) -> None:
    """Take the pictures of reports."""
    for scenario in ("two-robots", "test-scenario"):
        cxbridge("trace", "report", record(folder, scenario), "-o", folder / f"{scenario}.html")
    two = (folder / "two-robots.html").as_uri()
    test = (folder / "test-scenario.html").as_uri()
    take_picture(browser, two, "page-light")
    take_picture(browser, f"{test}#/timeline/goal/gen18", "page-dark", color_scheme="dark")
    take_picture(browser, test, "page-phone", viewport=PHONE)


def take_picture(browser: Any, url: str, name: str, **options: Any) -> None:
    """Take the picture of a page with a timeline; the options are those of the browser's page."""
    tab = browser.new_page(**({"viewport": DESK} | options))
    tab.goto(url)
    tab.wait_for_selector(".tl [role=treeitem]")
    tab.wait_for_timeout(1000)  # long enough to draw the timeline
    tab.screenshot(path=HERE / f"{name}.png")
    tab.close()


def take_exploration(browser: Any, folder: Path) -> None:
    """Take the picture of the map of an exploration, with runs that violate a property."""
    page = folder / "map.html"
    violated_property = "never (goal (mode FINISHED) (outcome FAILED) (class TALK))"
    options = ["--property", violated_property, "--out", folder / "out", "--html", page]
    command = [sys.executable, "-m", "cxbridge", "explore", "scenarios/test-scenario", *options]
    # not checked, because a violated property is an exit status
    subprocess.run(list(map(str, command)), check=False, cwd=ROOT, stdout=subprocess.DEVNULL)
    tab = browser.new_page(viewport=DESK)
    tab.goto(page.as_uri())
    tab.wait_for_selector("svg.runs")
    tab.screenshot(path=HERE / "explore-map.png")
    tab.close()


PICTURES: dict[str, Callable[[Any, Path], None]] = {
    "timeline": film,
    "reports": take_reports,
    "exploration": take_exploration,
}


def main(names: list[str]) -> None:
    """Make the named pictures; all pictures without a name."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright, TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        for name in names or PICTURES:
            PICTURES[name](browser, Path(folder))


if __name__ == "__main__":
    main(sys.argv[1:])
