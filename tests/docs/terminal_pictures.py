"""Makes the pictures of the terminal: `python -m tests.docs.terminal_pictures [FOLDER]`.

They go to docs/images by default, and are of real runs:
of a daemon that has stopped at a breakpoint, of a recording, of `cxbridge run`.
"""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
import tempfile
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from cxbridge.blackboard.urls import open_blackboard
from cxbridge.clock import RealClock
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge_studio.monitor.layout import RECORDED_PANES
from cxbridge_studio.monitor.live import DaemonSource
from cxbridge_studio.monitor.recorded import RecordedSource
from cxbridge_studio.monitor.screen import MonitorApp, make_monitor_app
from tests.support import ROOT

CXBRIDGE = [sys.executable, "-m", "cxbridge"]
SCENARIO = "test-scenario"
SIZE = (120, 36)


def main() -> None:
    """Make all pictures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images"
    with tempfile.TemporaryDirectory(prefix="cx") as scratch:
        recording = Path(scratch) / "run.mcap"
        story(folder / "run.svg", recording)
        picture(RecordedSource(recording), folder / "monitor-recording.svg", at_end)
        url = f"ipc://{scratch}/board"
        command = [*CXBRIDGE, "daemon", "start", SCENARIO, "--endpoint", url, "--no-fawkes", "-q"]
        with subprocess.Popen(command) as daemon:
            try:
                source = DaemonSource(
                    "tcp://robot:1911", lambda: open_blackboard(url, InterfaceRegistry(()), RealClock())
                )
                picture(source, folder / "monitor.svg", at_breakpoint)
            finally:
                daemon.terminate()


def story(path: Path, recording: Path) -> None:
    """Draw the output of `cxbridge run` on a terminal."""
    command = [*CXBRIDGE, "run", SCENARIO, "--trace", str(recording), "--trace-level", "facts"]
    environment = {**os.environ, "FORCE_COLOR": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    console = Console(record=True, width=SIZE[0], file=open(os.devnull, "w"))  # noqa: SIM115, PTH123
    console.print(Text("$ cxbridge run test-scenario", style="bold"))
    console.print(Text.from_ansi(done.stdout))
    path.write_text(console.export_svg(title="cxbridge run"))


def picture(source: Any, path: Path, script: Callable[[MonitorApp, Any], Awaitable[None]]) -> None:
    """Draw the monitor's screen after a script of keys."""

    async def run() -> str:
        app = make_monitor_app(source)
        async with app.run_test(size=SIZE) as pilot:
            await script(app, pilot)
            return app.export_screenshot(title="cxbridge monitor")

    path.write_text(asyncio.run(run()))


async def until(pilot: Any, condition: Callable[[], bool]) -> None:
    """Wait for a condition."""
    for _ in range(600):
        if condition():
            return
        await pilot.pause(0.1)
    raise TimeoutError("the screen does not show what it shall")


async def at_end(app: MonitorApp, pilot: Any) -> None:
    """Go back by some transitions, and look at the events: facts have paths of this machine."""
    await until(pilot, lambda: len(app.snapshot.goals) > 0)
    for _ in range(40):
        await pilot.press("comma")
    await pilot.press(str(RECORDED_PANES.index("events") + 1))
    await pilot.pause(1.0)


async def at_breakpoint(app: MonitorApp, pilot: Any) -> None:
    """Stop at a goal."""
    await until(pilot, lambda: "running" in app.snapshot.head)
    app.action_do("break goal:HANG-NOOP:DISPATCHED")
    await until(pilot, lambda: bool(app.snapshot.stop))
    await pilot.pause(1.0)


if __name__ == "__main__":
    main()
