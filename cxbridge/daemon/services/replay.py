"""Replay of a recording on a blackboard as a separate process."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import PurePath
from typing import Any

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.names import parse_uid
from cxbridge.blackboard.patterns import Pattern
from cxbridge.daemon.services.options import ReplayOptions
from cxbridge.daemon.services.service import ReadyCallback, Service, do_nothing, format_write_counts
from cxbridge.errors import BlackBoardError, TraceError
from cxbridge.events import Sink
from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.interfaces.xml.parser import parse_bytes
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.replay.pace import Pace
from cxbridge.trace.replay.player import ReplayPlayer
from cxbridge.trace.replay.replayed_writes import (
    ReplayedWrite,
    ReplaySelection,
    ReplaySurvey,
    replayed_writes,
    survey_replay,
)

DONE, INTERRUPTED, LOST = "done", "interrupted", "lost"
"""The ends of a replay: the recording has ended, the replay was stopped, or the connection is lost."""


@dataclass(slots=True)
class ReplayReport:
    """The result of a replay.

    :ivar run: the path of the recording.
    :ivar url: the URL of the blackboard.
    :ivar end: ``done``, ``interrupted`` or ``lost``; empty during the replay.
    :ivar seconds: the duration in real time.
    :ivar round_count: the number of started rounds.
    :ivar write_counts: the number of writes by ``Type::id``.
    :ivar notes: warnings about the file.
    """

    run: str
    url: str
    end: str = ""
    seconds: float = 0.0
    round_count: int = 0
    write_counts: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def to_json(self) -> dict[str, Any]:
        """Return the result for JSON."""
        return {
            "run": self.run,
            "url": self.url,
            "end": self.end,
            "seconds": round(self.seconds, 3),
            "rounds": self.round_count,
            "writes": sum(self.write_counts.values()),
            "interfaces": dict(sorted(self.write_counts.items())),
            "notes": self.notes,
        }

    def to_lines(self) -> list[str]:
        """Return the result as lines of text."""
        return [
            f"{self.end}: {format_write_counts(self.write_counts)} in {self.seconds:.1f} s",
            *(f"  {uid}  {count}" for uid, count in sorted(self.write_counts.items())),
        ]


def replay(
    options: ReplayOptions,
    *,
    console: Sink | None = None,
    on_ready: ReadyCallback = do_nothing,
    on_progress: Callable[[ReplayReport], None] = do_nothing,
) -> ReplayReport:
    """Replay a recording once or, with ``loop``, in rounds.

    SIGINT, SIGTERM, SIGHUP and the loss of the connection end the replay early.

    :param console: gets the log lines.
    :param on_ready: called with a stop function when all interfaces are open.
    :param on_progress: called with the present result several times a second during waits, and at the end.
    :raises CxbridgeError: if a pattern is invalid, the recording cannot be read or has no selected write, a
        recorded write does not fit the interface type, no server answers at the URL, or the blackboard
        refuses the replay.
    """
    registry = InterfaceRegistry(options.interface_dirs)
    selection = ReplaySelection(tuple(map(Pattern.parse, options.patterns)), options.start_s, options.end_s)
    run = open_run(options.run, registry)
    # one pass before the first write finds all interfaces, which are opened first: if one of them has another
    # writer, nothing is replayed
    survey = survey_replay(run, selection)
    _check_has_writes(run, survey)
    add_attached_types(registry, run, survey.write_counts)
    report = ReplayReport(str(options.run), options.url, notes=list(run.notes))
    with Service(console, on_ready) as service:
        board = service.open_blackboard(options.url, registry)
        player = ReplayPlayer(board)
        service.callback(player.close)
        session = _ReplaySession(options, board, player, report, service.stopped, on_progress)
        player.open(survey)
        service.report_ready(f"replaying {options.run} to {options.url}")
        session.run(lambda: replayed_writes(run, selection))
    return report


class _ReplaySession:
    """A replay with opened interfaces.

    :param report: updated during the replay.
    :param stop_event: set when the replay is to end, or the connection is lost.
    :param on_progress: called with the report several times a second during waits, and at the end.
    """

    def __init__(
        self,
        options: ReplayOptions,
        board: BlackBoard,
        player: ReplayPlayer,
        report: ReplayReport,
        stop_event: threading.Event,
        on_progress: Callable[[ReplayReport], None],
    ) -> None:
        self._options, self._board, self._player, self._report = options, board, player, report
        self._stop_event, self._on_progress = stop_event, on_progress
        self._is_connection_lost = False
        self._start_s = time.monotonic()
        board.add_connection_callback(self._handle_connection_change)

    def run(self, make_writes: Callable[[], Iterable[ReplayedWrite]]) -> None:
        """Replay once, or in rounds until the stop, and complete the report."""
        report = self._report
        pace = Pace(self._options.speed, self._stop_event, self._update_report)
        try:
            while True:
                report.round_count += 1
                is_complete = self._player.play(make_writes(), pace)
                if not (is_complete and self._options.loop) or self._stop_event.is_set():
                    break
            if is_complete and not self._options.loop:  # even if the stop came after the last write
                report.end = DONE
                self._board.flush()  # the last writes may still be on their way to the server
        except BlackBoardError:
            if self._board.connected and not self._is_connection_lost:
                raise  # a refusal of the blackboard, not the end of the connection
            self._is_connection_lost = True
        if self._is_connection_lost:
            report.end = LOST
        report.end = report.end or INTERRUPTED
        self._update_report()

    def _update_report(self) -> None:
        report, player = self._report, self._player
        report.seconds = time.monotonic() - self._start_s
        report.write_counts = dict(player.write_counts)
        self._on_progress(report)

    def _handle_connection_change(self, connected: bool) -> None:
        if not connected:
            self._is_connection_lost = True
            self._stop_event.set()


def _check_has_writes(run: Run, survey: ReplaySurvey) -> None:
    """Raise :class:`TraceError` if no write of the run is selected."""
    if not survey.write_counts:
        message, hint = (
            (
                "none of its interface writes is selected",
                "see 'cxbridge trace cat FILE --kind interface'",
            )
            if survey.unselected_write_count
            else (
                "it holds no interface writes, so there is nothing to replay",
                "record an mcap file, or bblogger files; a text log has none",
            )
        )
        raise TraceError(message, file=run.path, hint=hint)


def add_attached_types(registry: InterfaceRegistry, run: Run, uids: Iterable[str]) -> None:
    """Add unknown interface types that are attached to the run as ``<Type>.xml`` to a registry.

    :param uids: ``Type::id`` of the interfaces that need their types.
    :raises InterfaceDefinitionError: if such a file is invalid.
    """
    missing_types = {
        interface_type for interface_type, _ in map(parse_uid, uids) if registry.path(interface_type) is None
    }
    for attachment in run.attachments() if missing_types else ():
        name = PurePath(attachment.name)
        if name.suffix == ".xml" and name.stem in missing_types:
            schema = parse_bytes(attachment.data, f"{run.path}: {attachment.name}")
            registry.add(make_interface_class(schema))
