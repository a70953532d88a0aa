"""Recordings of the real node, and runs of cxbridge with the same parameters."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge.mainloop import Hook
from cxbridge.run import run_scenario
from cxbridge.run.agent import Run
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge.run.result import RunResult
from cxbridge_ros2.node import Node
from cxbridge_ros2cx.cx.node import CxNode
from tests.support import CX_DIR, CX_NEWER_DIR, SHARED

FOLDER: Final = SHARED / "traces" / "ros2cx"
_PARAMETERS: Final = re.compile(r"^parameters: (?:ros2cx|upstream-2026-06-14)/(\S+)$", re.MULTILINE)
_NEWER: Final = "upstream/"
_PREFIX: Final = re.compile(r"\[[^]]*\] \[[^]]*\] \[\w+\] ")
_COLOUR: Final = re.compile(r"\x1b\[\d+m")
_PROGRAM: Final = re.compile(r"/[\w/.-]+/tests/[\w/.-]+\.clp")
_PATH: Final = re.compile(
    r"/[\w/-]+/(?:overlay|ws2?/install)|/\S*/cxbridge/ros2cx/[0-9a-f]{12}|/\S*/prefix\b"
)


@dataclass(frozen=True)
class Recording:
    """The options of the comparison of a run with a recording.

    :param seconds: the duration of a run with the same ticks.
    :param ignored: a pattern of text that differs between recordings, too, e.g. times.
    :param select: selects the compared lines of a log; all by default.
    :param peer: makes the step of a peer from a node; each loop calls the step with the seconds of the run.
    :param status: the exit status: 1 after reported errors.
    :param crashes: the original crashes or is killed, so its log files lack lines and the console counts.
    :param text: a text of the parameters and its replacement.
    """

    seconds: float = 6.0
    ignored: str = ""
    select: Callable[[list[str]], list[str]] = list
    peer: Callable[[Node], Callable[[float], None]] | None = None
    status: int = 0
    crashes: bool = False
    text: tuple[str, str] = ("", "")


def find_recordings() -> list[str]:
    """Return the names of all recordings, with the folder for recordings of upstream's branch."""
    return sorted(str(file.parent.relative_to(FOLDER)) for file in FOLDER.rglob("notes.md")) if FOLDER else []


def find_parameters(name: str, folder: Path, text: tuple[str, str] = ("", "")) -> Path:
    """Return the parameter file of a recording, from the folder of the recording or from the checkout."""
    old, new = text
    params_file, programs = FOLDER / name / "params.yaml", [*(FOLDER / name).glob("*.clp")]
    if params_file.is_file():
        program = str(programs[0]) if programs else ""
        (folder / "params.yaml").write_text(
            _PROGRAM.sub(program, params_file.read_text()).replace(old, new, 1)
        )
        return folder / "params.yaml"
    match = _PARAMETERS.search((FOLDER / name / "notes.md").read_text())
    assert match, name
    return Path(str(find_checkout(name))) / match[1]


def find_checkout(name: str) -> Path | None:
    """Return the checkout of a recording, or None if the checkout is absent."""
    return CX_NEWER_DIR if name.startswith(_NEWER) else CX_DIR


def read_logs(name: str, *, crashes: bool = False) -> dict[str, list[str]]:
    """Return the log lines of a recording by environment, from the console if the node crashes."""
    files = sorted((FOLDER / name).glob("clips-*.log"))
    logs = {file.stem.removeprefix("clips-"): file.read_text().splitlines() for file in files}
    if not crashes:
        return logs
    console = _COLOUR.sub("", (FOLDER / name / "stdout.log").read_text())
    line = r"^\[\w+\] \[[\d.]+\] \[{}\]: (.*)$"
    return {env: re.findall(line.format(env), console, re.MULTILINE) for env in logs}


def read_environments(name: str) -> list[str]:
    """Return the environments of a recording in the order of their activation."""
    console = (FOLDER / name / "stdout.log").read_text()
    return re.findall(r"Loading plugins for (\S+)\.$", console, re.MULTILINE)


def run(name: str, folder: Path, recording: Recording) -> tuple[RunResult, dict[str, list[str]]]:
    """Run the parameters of a recording, and return the result and the log lines by environment."""
    logs = folder / "logs"
    options = options_from_keywords(
        find_parameters(name, folder, recording.text),
        ros2cx=find_checkout(name),
        timeout=recording.seconds,
        log_dir=logs,
        hash_order=True,
    )

    def attach(assembly: Run) -> None:
        if recording.peer is not None:
            assert isinstance(assembly.executive, CxNode)
            step = recording.peer(assembly.executive.manager.context.ros.graph.join("peer"))
            begun_us = assembly.clock.now_us()
            assembly.loop.add(
                Hook.PRE_LOOP, lambda: step((assembly.clock.now_us() - begun_us) / MICROSECONDS)
            )

    result = run_scenario(options, attach=attach)
    return result, {file.stem: file.read_text().splitlines() for file in sorted(logs.glob("*.log"))}


def make_ros_prefix(prefix: Path) -> Path:
    """Make a prefix with the ROS packages that agents need."""
    index = prefix / "share" / "ament_index" / "resource_index"
    cmake = ("", "_core", "_export_definitions", "_export_dependencies")
    packages = ("action_msgs", *(f"ament_cmake{each}" for each in cmake), "rclcpp")
    contents = {f"packages/{name}": "" for name in packages}
    for name, text in (contents | {"vendor_packages/clips_vendor": "opt/clips_vendor"}).items():
        (index / name).parent.mkdir(parents=True, exist_ok=True)
        (index / name).write_text(text)
    return prefix


def normalise(lines: list[str], ignored: str = "") -> list[str]:
    """Return log lines without variable parts: times, indices of facts and paths."""
    result_lines = []
    for line in lines:
        text = _PATH.sub("PREFIX", _PREFIX.sub("", line, count=1))
        text = re.sub(r"\b[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\b", "UUID", text)
        text = re.sub(r"\bf-\d+\b *", "f-N ", re.sub(r"FIRE +\d+", "FIRE N", text))
        text = re.sub(r"<Pointer-C-0x[0-9a-f]+>", "<Pointer>", text)
        result_lines.append(re.sub(ignored, "#", text) if ignored else text)
    return result_lines
