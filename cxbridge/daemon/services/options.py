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

    :param outputs: files with the suffix ``.mcap``, and folders for bblogger files.
    :param duration_s: the duration of the recording; None: until an interrupt.
    """

    patterns: Annotated[
        tuple[str, ...],
        Meta(description="Interfaces to record: TYPE or TYPE::ID with *, ?, []; may be given several times."),
    ]
    outputs: Annotated[
        tuple[Path, ...],
        Meta(
            description="FILE.mcap, or a folder for files in the format of Fawkes' bblogger; may be given "
            "several times."
        ),
    ]
    url: Annotated[str, Meta(description="The blackboard.")] = DAEMON_URL
    duration_s: Annotated[
        float | None, Meta(description="End after SECONDS; by default at Ctrl-C.", ge=0)
    ] = None
    interface_dirs: Annotated[tuple[Path, ...], Meta(description="Definitions of interfaces.")] = ()


@dataclass(frozen=True, kw_only=True)
class ReplayOptions:
    """The options of ``cxbridge trace replay``; see its help.

    :param start_s: the start in seconds since the first event of the recording; None: the first event.
    :param end_s: the end in seconds since the first event of the recording; None: the last event.
    """

    run: Annotated[Path, Meta(description="An mcap file, or a file or folder of bblogger.")]
    url: Annotated[str, Meta(description="The blackboard.")] = DAEMON_URL
    patterns: Annotated[
        tuple[str, ...],
        Meta(
            description="Interfaces to replay: TYPE or TYPE::ID with *, ?, []; may be given several times; "
            "all by default."
        ),
    ] = ()
    speed: Annotated[
        float, Meta(description="Replay N seconds of the recording in a second.", ge=1e-06, le=1000000.0)
    ] = 1.0
    start_s: Annotated[
        float | None,
        Meta(description="Begin SECONDS after the first event.", ge=0),
    ] = None
    end_s: Annotated[
        float | None,
        Meta(description="End SECONDS after the first event.", ge=0),
    ] = None
    loop: Annotated[bool, Meta(description="Repeat the replay until Ctrl-C.")] = False
    interface_dirs: Annotated[tuple[Path, ...], Meta(description="Definitions of interfaces.")] = ()


@dataclass(frozen=True, kw_only=True)
class ExecutorOptions:
    """The options of ``cxbridge skill executor``; see its help.

    :param name: the id of the executor's interface; by default ``AGENT-CLASS``.
    """

    target: Annotated[str, Meta(description="The class of the executor, a SkillExecutor; or FILE.py:CLASS.")]
    agent: Annotated[str, Meta(description="The agent (robot) for which the executor works.")]
    url: Annotated[str, Meta(description="The blackboard.")] = DAEMON_URL
    name: Annotated[str, Meta(description="Id of the executor; AGENT-CLASS by default.")] = ""
    settings: Annotated[
        tuple[str, ...],
        Meta(description="NAME=VALUE, a setting of the class. Repeatable."),
    ] = ()
    interface_dirs: Annotated[tuple[Path, ...], Meta(description="Definitions of interfaces.")] = ()
