"""Makes the pictures of the page in docs/images: each view in light, dark and on a telephone of 390 pixels.

Run with ``python -m tests.web.page.pictures [NAME...]``: of all views, or of those that are named. A daemon
runs the scenario of two robots; the recording is one of the test scenario.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

from cxbridge.web import pages
from tests.support import ROOT
from tests.trace.html.browser import BROWSER
from tests.web.support import serving

IMAGES = ROOT / "docs" / "images"
SIZES = {"light": (1440, 900), "dark": (1440, 900), "phone": (390, 844)}
SETTLE_MS = 1500


def _nothing(_page: Any) -> None:
    pass


def _why(page: Any) -> None:
    page.click("#why-rule")
    page.wait_for_selector("#why-text .why")


def _search(page: Any) -> None:
    page.keyboard.press("Control+k")
    page.keyboard.type("lab")
    page.wait_for_selector(".found")


def _debug(page: Any) -> None:
    page.click("#debug-open")
    page.wait_for_selector("#stopped")


def _recording(page: Any) -> None:
    with page.expect_file_chooser() as chooser:
        page.click("#open-recording")
    chooser.value.set_files(page.recording)
    page.wait_for_selector("#moment")
    page.locator("#moment").fill("120")


VIEWS: dict[str, tuple[str, Callable[[Any], None]]] = {
    "run": ("goals?goal=", _nothing),
    "goals": ("goals/INSPECT-lab", _nothing),
    "skills": ("skills/move", _nothing),
    "domain": ("domain/operators/move", _nothing),
    "blackboard": ("blackboard/SkillerInterface%3A%3Arobot1", _nothing),
    "graph": ("blackboard/graph", _nothing),
    "clips": ("clips/rules/robots-choose", _why),
    "facts": ("clips/facts", _nothing),
    "environments": ("clips/environments/executive", _nothing),
    "log": ("log", _nothing),
    "config": ("config", _nothing),
    "search": ("goals?goal=", _search),
    "debug": ("goals?goal=", _debug),
    "not-found": ("nowhere", _nothing),
    "recording": ("goals/gen14", _recording),
}


def shoot(browser: Any, url: str, name: str, recording: Path) -> None:
    """Make the pictures of one view."""
    address, prepare = VIEWS.get(name, (name, _nothing))
    for kind, (width, height) in SIZES.items():
        page = browser.new_page(
            viewport={"width": width, "height": height},
            color_scheme="dark" if kind == "dark" else "light",
            reduced_motion="reduce",
        )
        page.recording = recording
        page.goto(f"{url}/#/{address}")
        page.wait_for_selector("#state >> text=RUNNING")
        page.wait_for_timeout(SETTLE_MS)
        prepare(page)
        page.wait_for_timeout(SETTLE_MS / 3)
        page.screenshot(path=IMAGES / f"web-{name}-{kind}.png")
        page.close()


def main(names: list[str]) -> None:
    """Make the pictures."""
    tabs = {path.stem for path in pages.VIEWS.glob("*.js") if "export const tab" in path.read_text()}
    wanted = names or [*VIEWS, *sorted(tabs - VIEWS.keys())]
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / "test-scenario.mcap"
        command = f"-m cxbridge run {ROOT}/scenarios/test-scenario --trace-level facts --trace {recording}"
        subprocess.run([sys.executable, *command.split()], check=True, capture_output=True)
        scenario = ROOT / "scenarios" / "two-robots"
        with (
            serving((("clock", "scaled:4"),), config=scenario) as (_, client, _lines),
            sync_playwright() as playwright,
        ):
            browser = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
            for name in wanted:
                shoot(browser, client.url, name, recording)
            browser.close()


if __name__ == "__main__":
    main(sys.argv[1:])
