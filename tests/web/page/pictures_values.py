"""Makes the pictures of Plot, Map and state graphs: ``python -m tests.web.page.pictures_values``.

Runs the scenario ``waypoints`` eight times as fast as real, records it, and opens the recording in the page.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from tests.support import ROOT
from tests.trace.html.browser import BROWSER
from tests.web.page.fake import FakeDaemon, Served, served

IMAGES: Final = ROOT / "docs" / "images"
POSE: Final = "Position3DInterface::Pose.translation"
SERIES: Final = (f"{POSE}[0]", f"{POSE}[1]", "executive:plan-action{id=3}.state", "loop")
VIEWS: Final = {"plot": "#/plot/" + "/".join(quote(name, safe="") for name in SERIES), "map": "#/map"}
LOOKS: Final[dict[str, dict[str, Any]]] = {
    "light": {"viewport": {"width": 1280, "height": 800}},
    "dark": {"viewport": {"width": 1280, "height": 800}, "color_scheme": "dark"},
    "phone": {"viewport": {"width": 390, "height": 844}},
}
_AT: Final = 0.7
"""The part of the run that has happened in the pictures."""


def record(path: Path) -> None:
    """Record a tour of the robot."""
    command = [sys.executable, "-m", "cxbridge", "run", str(ROOT / "scenarios" / "waypoints")]
    options = ["--clock", "scaled:8", "--trace", str(path), "--trace-level", "facts", "--quiet"]
    subprocess.run([*command, *options], check=True)


def take(browser: Any, site: Served, name: str, address: str, look: str) -> None:
    """Take one picture."""
    context = browser.new_context(**LOOKS[look])
    page = context.new_page()
    page.goto(f"{site.url}?run=files/run.mcap{address}")
    page.wait_for_selector("#state >> text=RECORDING")
    page.evaluate(
        """async (part) => {
          const { app } = await import("/js/app.js"), { begin, end } = app.recording;
          app.select({ time: Math.round(begin + part * (end - begin)) });
        }""",
        _AT,
    )
    page.wait_for_timeout(700)
    page.screenshot(path=IMAGES / f"web-{name}-{look}.png")
    context.close()


def main() -> None:
    """Make all pictures."""
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "run.mcap")
        record(path)
        daemon = FakeDaemon()
        daemon.files["run.mcap"] = path.read_bytes()
        with served(daemon) as site, sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
            for name, address in VIEWS.items():
                for look in LOOKS:
                    take(browser, site, name, address, look)
            browser.close()


if __name__ == "__main__":
    main()
