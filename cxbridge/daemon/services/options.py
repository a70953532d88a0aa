"""The options of the services."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from msgspec import Meta

from cxbridge.resources import DAEMON_URL


@dataclass(frozen=True, kw_only=True)
class RecordOptions:
    """The options of ``cxbridge trace record``; see its help.

    :param outputs: files that end with ``.mcap``, and folders for bblogger files.
    :param duration_s: None: until interrupted.
    :param switch: serve ``SwitchInterface::BBLogger``; None: unless the URL belongs to a Fawkes.
    """

    patterns: Annotated[
        tuple[str, ...],
        Meta(description="what to record: TYPE or TYPE::ID with *, ?, []; may be given several times"),
    ]
    outputs: Annotated[
        tuple[Path, ...],
        Meta(
            description="FILE.mcap, or a folder for files as Fawkes' bblogger has them; may be given "
            "several times"
        ),
    ]
    url: Annotated[str, Meta(description="the blackboard")] = DAEMON_URL
    duration_s: Annotated[
        float | None, Meta(description="end after SECONDS; by default with Ctrl-C", ge=0)
    ] = None
    scenario: Annotated[str, Meta(description="name of the recording, in bblogger files")] = "record"
    switch: Annotated[
        bool | None,
        Meta(description="let 'ffbblog enable' and 'disable' switch it; by default unless URL is a Fawkes"),
    ] = None
    interface_dirs: Annotated[tuple[Path, ...], Meta(description="definitions of interfaces")] = ()

    @property
    def wants_switch(self) -> bool:
        """Whether to serve the switch; by default not on a Fawkes, whose bblogger needs the interface."""
        return not self.url.startswith("fawkes:") if self.switch is None else self.switch


@dataclass(frozen=True, kw_only=True)
class ReplayOptions:
    """The options of ``cxbridge trace replay``; see its help.

    :param start_s: seconds since the first event of the recording; likewise ``end_s``.
    :param step: replay one event per key, or per line of a pipe, instead of in recorded time.
    """

    run: Annotated[Path, Meta(description="mcap, or a file or folder of bblogger")]
    url: Annotated[str, Meta(description="the blackboard")] = DAEMON_URL
    patterns: Annotated[
        tuple[str, ...],
        Meta(
            description="what to replay: TYPE or TYPE::ID with *, ?, []; may be given several times; by "
            "default all"
        ),
    ] = ()
    messages: Annotated[
        bool, Meta(description="send recorded messages to interfaces that are not replayed")
    ] = False
    speed: Annotated[float, Meta(description="N seconds of the recording in one", ge=1e-06, le=1000000.0)] = (
        1.0
    )
    step: Annotated[bool, Meta(description="one write a key; without a terminal, a line on stdin")] = False
    start_s: Annotated[
        float | None,
        Meta(description="begin SECONDS after the first event", ge=0),
    ] = None
    end_s: Annotated[
        float | None,
        Meta(description="end SECONDS after the first event", ge=0),
    ] = None
    restamp: Annotated[bool, Meta(description="stamp writes with the time of now, not the recorded one")] = (
        False
    )
    loop: Annotated[bool, Meta(description="from the start again, until Ctrl-C")] = False
    hold: Annotated[bool, Meta(description="stay the writer at the end, until Ctrl-C")] = False
    interface_dirs: Annotated[tuple[Path, ...], Meta(description="definitions of interfaces")] = ()


@dataclass(frozen=True, kw_only=True)
class ExecutorOptions:
    """The options of ``cxbridge skill executor``; see its help.

    :param name: the id of the executor's interface; empty: ``AGENT-CLASS``.
    """

    target: Annotated[str, Meta(description="or FILE.py:CLASS, a SkillExecutor")]
    agent: Annotated[str, Meta(description="the agent (robot) that it works for")]
    url: Annotated[str, Meta(description="the blackboard")] = DAEMON_URL
    name: Annotated[str, Meta(description="id of the executor; AGENT-CLASS by default")] = ""
    settings: Annotated[
        tuple[str, ...],
        Meta(description="a setting of the class; repeatable"),
    ] = ()
    interface_dirs: Annotated[tuple[Path, ...], Meta(description="definitions of interfaces")] = ()
