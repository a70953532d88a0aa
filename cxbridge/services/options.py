"""The options of the services."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from cxbridge.process.options import CONNECT, INTERFACE_DIR
from cxbridge.resources import DAEMON_URL


@dataclass(frozen=True, kw_only=True)
class RecordOptions:
    """The options of ``cxbridge trace record``; see its help.

    :param outputs: files that end with ``.mcap``, and folders for bblogger files.
    :param duration_s: seconds after which to end; None: when it is interrupted.
    :param switch: serve ``SwitchInterface::BBLogger``; None: unless the URL is a Fawkes'.
    """

    patterns: Annotated[
        tuple[str, ...],
        typer.Option(
            "--interface",
            "-i",
            metavar="GLOB",
            help="what to record: TYPE or TYPE::ID with *, ?, []; may be given several times",
        ),
    ]
    outputs: Annotated[
        tuple[Path, ...],
        typer.Option(
            "--output",
            "-o",
            metavar="PATH",
            help="FILE.mcap, or a folder for files as Fawkes' bblogger has them; may be given several times",
        ),
    ]
    url: Annotated[str, CONNECT] = DAEMON_URL
    duration_s: Annotated[
        float | None, typer.Option("--duration", min=0, help="end after so many seconds; else with Ctrl-C")
    ] = None
    scenario: Annotated[str, typer.Option(help="name of the recording, in bblogger files")] = "record"
    switch: Annotated[
        bool | None,
        typer.Option(
            "--switch/--no-switch",
            help="let 'ffbblog enable' and 'disable' switch it; by default unless URL is a Fawkes",
            show_default=False,
        ),
    ] = None
    interface_dirs: Annotated[tuple[Path, ...], INTERFACE_DIR] = ()

    @property
    def wants_switch(self) -> bool:
        """Whether to serve the switch. A bblogger that is loaded later could not, so not on a Fawkes."""
        return not self.url.startswith("fawkes:") if self.switch is None else self.switch


@dataclass(frozen=True, kw_only=True)
class ReplayOptions:
    """The options of ``cxbridge trace replay``; see its help.

    :param start_s: seconds since the first event of the recording; ``end_s`` likewise.
    :param step: a write for each key, or for each line of a pipe; else in recorded time.
    """

    run: Annotated[Path, typer.Argument(metavar="RUN", help="mcap, or a file or folder of bblogger")]
    url: Annotated[str, CONNECT] = DAEMON_URL
    patterns: Annotated[
        tuple[str, ...],
        typer.Option(
            "--interface",
            "-i",
            metavar="GLOB",
            help="what to replay: TYPE or TYPE::ID with *, ?, []; may be given several times; by default all",
        ),
    ] = ()
    messages: Annotated[
        bool, typer.Option("--messages", help="send recorded messages to interfaces that are not replayed")
    ] = False
    speed: Annotated[
        float, typer.Option(min=1e-6, max=1e6, help="so many seconds of the recording in one")
    ] = 1.0
    step: Annotated[
        bool, typer.Option("--step", help="one write a key; without a terminal, a line on stdin")
    ] = False
    start_s: Annotated[
        float | None,
        typer.Option("--from", min=0, metavar="S", help="begin so many seconds after the first event"),
    ] = None
    end_s: Annotated[
        float | None,
        typer.Option("--to", min=0, metavar="S", help="end so many seconds after the first event"),
    ] = None
    restamp: Annotated[
        bool, typer.Option("--restamp", help="stamp writes with the time of now, not the recorded one")
    ] = False
    loop: Annotated[bool, typer.Option("--loop", help="from the start again, until Ctrl-C")] = False
    hold: Annotated[bool, typer.Option("--hold", help="stay the writer at the end, until Ctrl-C")] = False
    interface_dirs: Annotated[tuple[Path, ...], INTERFACE_DIR] = ()


@dataclass(frozen=True, kw_only=True)
class ExecutorOptions:
    """The options of ``cxbridge skill executor``; see its help.

    :param name: id of the executor's interface; empty: ``AGENT-CLASS``.
    """

    target: Annotated[str, typer.Argument(metavar="MODULE:CLASS", help="or FILE.py:CLASS, a SkillExecutor")]
    agent: Annotated[str, typer.Option(metavar="NAME", help="the agent (robot) that it works for")]
    url: Annotated[str, CONNECT] = DAEMON_URL
    name: Annotated[
        str, typer.Option(metavar="ID", help="id of the executor; AGENT-CLASS by default", show_default=False)
    ] = ""
    settings: Annotated[
        tuple[str, ...],
        typer.Option("--set", metavar="NAME=VALUE", help="a setting of the class; repeatable"),
    ] = ()
    interface_dirs: Annotated[tuple[Path, ...], INTERFACE_DIR] = ()
