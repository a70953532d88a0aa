"""Makes the pictures of the page in docs/images: each view in light, dark and on a telephone of 390 pixels.

Run with ``python -m web_tests.page.pictures [NAME...]`` for all views, or for the named views. A daemon
runs the scenario of two robots; ``view`` shows recordings of the test scenario and of a robot's tour.
tests/docs/terminal_pictures.py makes the pictures of the terminal, docs/images/make_timeline.py the film of
the timeline and the pictures of reports.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from cxbridge.clock import RealClock
from cxbridge.events import EventBus
from cxbridge.run.options import RunOptions
from cxbridge_explore.counterexample_playing import play_run
from cxbridge_explore.worlds.points import RandomChooser
from cxbridge_web import pages
from cxbridge_web.http.recordings import RecordingsApp
from cxbridge_web.http.serving import HttpThread
from cxbridge_web.settings import WebSettings
from tests.support import ROOT
from tests.trace.html.browser import BROWSER
from web_tests.support import serving

IMAGES: Final = ROOT / "docs" / "images"
LOOKS: Final[Mapping[str, dict[str, Any]]] = {
    "light": {"viewport": {"width": 1440, "height": 900}},
    "dark": {"viewport": {"width": 1440, "height": 900}, "color_scheme": "dark"},
    "phone": {"viewport": {"width": 390, "height": 844}},
}
COMPARE_PATH: Final = "compare"
_SEED: Final = 47
_SETTLE_MS: Final = 1500
_POSE: Final = "Position3DInterface::Pose.translation"
_SERIES: Final = (f"{_POSE}[0]", f"{_POSE}[1]", "executive:plan-action{id=3}.state", "loop")

FAULTY: Final = "two-robots, a place is missing"
"""The run of two robots with a navigation graph without a place."""
_MISSING: Final = "lab"
STUCK: Final = "two-robots, no robot becomes free"
"""The run of two robots whose agent does not free a robot after its goal."""
_FREES: Final = "(modify ?robot (goal nil))"

Prepare = Callable[[Any], None]


@dataclass(frozen=True)
class Shot:
    """A picture to take.

    :param address: the address of the view below ``#/``.
    :param prepare: changes the page before the picture.
    :param run: the scenario of the shown recording, FAULTY or STUCK; empty for the page of the daemon;
        ``compare`` for two runs of two robots, of which the second has failed skills.
    """

    address: str
    prepare: Prepare = lambda _page: None
    run: str = ""


def _why(page: Any) -> None:
    page.click("#why-rule")
    page.wait_for_selector("#why-text .why")


def _search(page: Any) -> None:
    page.keyboard.press("Control+k")
    page.keyboard.type("lab")
    page.wait_for_selector(".found")


def _keys(page: Any) -> None:
    page.keyboard.press("?")
    page.wait_for_selector("#help[open]")


def _moment(part: float) -> Prepare:
    """Return a function that selects the moment after ``part`` of the run."""

    def prepare(page: Any) -> None:
        page.evaluate(
            """async (part) => {
              const { app } = await import("cx/app.js"), { begin, end } = app.recording;
              app.select({ time: Math.round(begin + part * (end - begin)) });
            }""",
            part,
        )

    return prepare


def _send(page: Any) -> None:
    """Select a moment, and copy the address of the moment."""
    _moment(0.6)(page)
    page.keyboard.press("l")
    page.wait_for_selector(".toast >> text=is copied")


SHOTS: Final[Mapping[str, Shot]] = {
    "now": Shot("timeline"),  # comes first, because the run of the daemon ends
    "story": Shot("timeline", run=FAULTY),
    "goals": Shot("goals/INSPECT-lab", run=FAULTY),
    "failed": Shot("goals?goal=&outcome=failed", run=FAULTY),
    "stuck": Shot("timeline", run=STUCK),
    "moment": Shot("goals/INSPECT-office", _send, run="two-robots"),
    "keys": Shot("timeline", _keys),
    "search": Shot("goals?goal=", _search),
    "skills": Shot("skills/move"),
    "blackboard": Shot("blackboard/SkillerInterface%3A%3Arobot1"),
    "clips": Shot("clips/rules/robots-choose", _why),
    "facts": Shot("clips/facts"),
    "not-found": Shot("nowhere"),
    "timeline": Shot("timeline/goal/gen18", run="test-scenario"),
    "recording": Shot("goals/gen14", _moment(0.4), run="test-scenario"),
    "plot": Shot("plot/" + "/".join(quote(name, safe="") for name in _SERIES), _moment(0.7), run="waypoints"),
    "world": Shot("world", _moment(0.7), run="two-robots"),
    "compare": Shot("", run=COMPARE_PATH),
}


def record(folder: Path, scenario: str) -> Path:
    """Return the recording of a run; the tour has a scaled clock, so that its recording has loop times."""
    folder = Path(tempfile.mkdtemp(dir=folder))  # the runs of a scenario have the same name
    path = folder / f"{scenario.partition(',')[0]}.mcap"
    options = ["--trace", str(path), "--trace-level", "facts", "--quiet"]
    options += ["--clock", "scaled:8"] if scenario == "waypoints" else []
    options += ["--config", str(_write_faulty_config(folder))] if scenario == FAULTY else []
    started = _write_stuck_scenario(folder) if scenario == STUCK else ROOT / "scenarios" / path.stem
    command = [sys.executable, "-m", "cxbridge", "run", str(started), "--timeout", "60", *options]
    subprocess.run(command, check=scenario not in {FAULTY, STUCK})
    return path


def record_failures(folder: Path) -> Path:
    """Return the recording of a run of two robots with random failures of skills."""
    path = folder / "two-robots-today.mcap"
    options = RunOptions(scenario=ROOT / "scenarios" / "two-robots", skiller="none", timeout=120.0)
    play_run(options, (), RandomChooser(_SEED), path)
    return path


def _write_faulty_config(folder: Path) -> Path:
    """Write the configuration of a navigation graph without a place, and return its path."""
    lines = (ROOT / "scenarios" / "two-robots" / "navgraph.yaml").read_text("utf-8").splitlines(keepends=True)
    graph, config = folder / "navgraph.yaml", folder / "fault.yaml"
    graph.write_text("".join(line for line in lines if _MISSING not in line), "utf-8")
    move = f"{{executors: {{move: {{navgraph: {graph}}}}}}}"
    config.write_text(f"skill-board: {{agents: {{robot1: {move}, robot2: {move}}}}}\n", "utf-8")
    return config


def _write_stuck_scenario(folder: Path) -> Path:
    """Write the scenario without the line that frees a robot, and return its path."""
    scenario = folder / "two-robots"
    shutil.copytree(ROOT / "scenarios" / "two-robots", scenario)
    goals = scenario / "robots-goals.clp"
    goals.write_text(goals.read_text("utf-8").replace(_FREES, ""), "utf-8")
    return scenario


@contextmanager
def serve_recordings(folder: Path, scenarios: list[str]) -> Iterator[dict[str, str]]:
    """Serve each recording as ``cxbridge view`` does; yield the addresses by scenario."""
    with ExitStack() as stack:
        addresses = {}
        for scenario in scenarios:
            recordings = RecordingsApp(
                [record(folder, "two-robots"), record_failures(folder)]
                if scenario == COMPARE_PATH
                else [record(folder, scenario)]
            )
            server = HttpThread(WebSettings(port=0), EventBus(RealClock()).logger("Web"))
            server.start(recordings)
            stack.callback(server.stop)
            addresses[scenario] = server.url + recordings.start_path
        yield addresses


def shoot(browser: Any, url: str, name: str, shot: Shot) -> None:
    """Take the pictures of a view."""
    for look, options in LOOKS.items():
        page = browser.new_page(
            reduced_motion="reduce", permissions=["clipboard-read", "clipboard-write"], **options
        )
        page.goto(url if shot.run == COMPARE_PATH else f"{url}#/{shot.address}")
        state = "RECORDING" if shot.run else "RUNNING"
        page.wait_for_selector(".comparison" if shot.run == COMPARE_PATH else f"#state >> text={state}")
        page.wait_for_timeout(_SETTLE_MS)
        shot.prepare(page)
        page.wait_for_timeout(_SETTLE_MS / 2)
        page.screenshot(path=IMAGES / f"web-{name}-{look}.png")
        page.close()


def main(names: list[str]) -> None:
    """Make the pictures."""
    from playwright.sync_api import sync_playwright

    tabs = {
        path.stem
        for path in pages.STATIC_FOLDER.glob("js/views/*.js")
        if "export const tab" in path.read_text()
    }
    shots = {**SHOTS, **{name: Shot(name) for name in sorted(tabs - SHOTS.keys())}}
    selected = {name: shots[name] for name in names or shots}
    runs = sorted({shot.run for shot in selected.values()} - {""})
    with (
        tempfile.TemporaryDirectory() as folder,
        serve_recordings(Path(folder), runs) as urls,
        serving((("clock", "scaled:1"),), config=ROOT / "scenarios" / "two-robots") as (_, client, _lines),
        sync_playwright() as playwright,
    ):
        urls[""] = f"{client.url}/"
        browser = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        for name, shot in selected.items():
            shoot(browser, urls[shot.run], name, shot)
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1:])
