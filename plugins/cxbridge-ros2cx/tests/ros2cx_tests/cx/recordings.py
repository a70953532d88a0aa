"""Recordings of the real node, and the runs of ours that do the same."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cxbridge.run import run_scenario
from cxbridge.run.program.run import make_options
from cxbridge.run.result import RunResult
from tests.support import CX_DIR, SHARED

FOLDER: Final = SHARED / "traces" / "ros2cx"
_PARAMETERS: Final = re.compile(r"^parameters: ros2cx/(\S+)$", re.MULTILINE)
_PREFIX: Final = re.compile(r"\[[^]]*\] \[[^]]*\] \[\w+\] ")
_PATH: Final = re.compile(
    r"/opt/ros2cx-real/(?:overlay|ws/install)|/\S*/cxbridge/ros2cx/[0-9a-f]{12}|/\S*/prefix\b"
)


@dataclass(frozen=True)
class Recording:
    """A recording.

    :param seconds: how long a run of ours takes for the same ticks.
    :param without: a pattern for what differs between two recordings, too, e.g. times.
    :param compared: what is compared of a log; all by default.
    """

    seconds: float = 6.0
    without: str = ""
    compared: Callable[[list[str]], list[str]] = list


def names() -> list[str]:
    """Return the names of all recordings, those of upstream's branch with their folder."""
    return sorted(str(file.parent.relative_to(FOLDER)) for file in FOLDER.rglob("notes.md")) if FOLDER else []


def parameters(name: str) -> Path:
    """Return the parameter file of a recording: its own, or that of the checkout."""
    own = FOLDER / name / "params.yaml"
    if own.is_file():
        return own
    match = _PARAMETERS.search((FOLDER / name / "notes.md").read_text())
    assert match, name
    assert CX_DIR is not None
    return CX_DIR / match[1]


def recorded(name: str) -> dict[str, list[str]]:
    """Return the lines of the logs of a recording, by environment."""
    files = sorted((FOLDER / name).glob("clips-*.log"))
    return {file.stem.removeprefix("clips-"): file.read_text().splitlines() for file in files}


def run(name: str, folder: Path, seconds: float) -> tuple[RunResult, dict[str, list[str]]]:
    """Run the parameters of a recording; return the result and the lines of the logs, by environment."""
    options = make_options(parameters(name), ros2cx=CX_DIR, timeout=seconds, log_dir=folder)
    result = run_scenario(options)
    return result, {file.stem: file.read_text().splitlines() for file in sorted(folder.glob("*.log"))}


def sourced(prefix: Path) -> Path:
    """Make a prefix with packages of a ROS that agents ask for."""
    index = prefix / "share" / "ament_index" / "resource_index"
    cmake = ("", "_core", "_export_definitions", "_export_dependencies")
    packages = ("action_msgs", *(f"ament_cmake{each}" for each in cmake), "rclcpp")
    contents = {f"packages/{name}": "" for name in packages}
    for name, text in (contents | {"vendor_packages/clips_vendor": "opt/clips_vendor"}).items():
        (index / name).parent.mkdir(parents=True, exist_ok=True)
        (index / name).write_text(text)
    return prefix


def comparable(lines: list[str], without: str = "") -> list[str]:
    """Return lines of a log without what is otherwise in each run: times, indices of facts, places."""
    found = []
    for line in lines:
        text = _PATH.sub("PREFIX", _PREFIX.sub("", line, count=1))
        text = re.sub(r"\bf-\d+\b *", "f-N ", re.sub(r"FIRE +\d+", "FIRE N", text))
        text = re.sub(r"<Pointer-C-0x[0-9a-f]+>", "<Pointer>", text)
        found.append(re.sub(without, "#", text) if without else text)
    return found
