"""The recordings of one run: their contents, and the alignment of their times."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from msgspec import structs

from cxbridge.clock import MICROSECONDS, VIRTUAL_EPOCH_US
from cxbridge.errors import TraceError
from cxbridge.events import InterfaceWrite
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.resources import shipped_dir
from cxbridge.run.options import RunOptions
from cxbridge.run.replay.scan import EXECUTOR, SKILLER, Scan, scan_recording
from cxbridge.run.replay.script import (
    ExecutorScript,
    SkillerScript,
    make_executor_script,
    make_skiller_script,
    reconstruct_writes,
)
from cxbridge.trace.formats.registry import open_run

# All offsets of time zones are multiples of 15 minutes.
_QUARTER_HOUR_US: Final = 900 * MICROSECONDS


@dataclass(frozen=True, slots=True)
class Recordings:
    """The contents of a recorded run.

    :param scans: a scan for each recording, in the order of the options.
    :param decisions: the scan whose transitions, or states of Skillers, are compared.
    :param start_us: the start of the run by the recorded clock; without times, the start of virtual clocks.
    """

    scans: tuple[Scan, ...]
    decisions: Scan
    start_us: int

    @classmethod
    def read(cls, paths: Sequence[Path], registry: InterfaceRegistry | None = None) -> Recordings:
        """Read the recordings of a run.

        :param registry: the interface types in bblogger files, by default cxbridge's definitions.
        :raises TraceError: if a recording cannot be read or lacks data for a replay.
        """
        scans = tuple(scan_recording(open_run(path, registry)) for path in paths)
        decisions = _find_decisions(scans)
        if decisions is None:
            raise TraceError(
                "there is nothing to compare with: neither transitions of goals nor states of Skillers",
                file=scans[0].run.path,
                hint="name the run's mcap or text log with another --replay",
            )
        if not any(scan.first_writes or (scan.statuses and scan.is_timed) for scan in scans):
            raise TraceError(
                "the recordings have neither interface writes nor times: there is no environment to replay",
                file=scans[0].run.path,
                hint="name the run's bblogger files, mcap or text log with another --replay",
            )
        _align_times(scans)
        begin_times = (
            scan.begin_us + scan.shift_us for scan in (decisions, *scans) if scan.begin_us is not None
        )
        return cls(scans, decisions, next(begin_times, VIRTUAL_EPOCH_US))

    @property
    def is_complete(self) -> bool:
        """Whether the recording reaches the end of the run."""
        return self.decisions.is_complete

    @property
    def envs(self) -> frozenset[str]:
        """The CLIPS environments with compared transitions."""
        return frozenset(self.decisions.envs)

    @property
    def end_us(self) -> int:
        """The time of the last transition or skill status; 0 if unknown."""
        decisions = self.decisions
        return decisions.end_us + decisions.shift_us if decisions.is_timed else 0

    def complete_options(self, options: RunOptions) -> RunOptions:
        """Return the options; if they name no agent, with scenario and spec of the recording.

        :raises TraceError: if the recorded scenario is needed, but not shipped with cxbridge.
        """
        if options.scenario is not None or options.fawkes_dir is not None:
            return options
        # a scenario is a program: a recording from elsewhere must not choose an arbitrary folder to execute
        for scan in self.scans:
            if scenario := scan.metadata.get("scenario"):
                if not _is_shipped(scenario):
                    raise TraceError(
                        f"it is a recording of the scenario {scenario!r}, which a recording must not start",
                        file=scan.run.path,
                        hint=f"if you trust that scenario, name it: cxbridge run {scenario} --replay FILE",
                    )
                return replace(
                    options,
                    scenario=Path(scenario),
                    spec=options.spec or scan.metadata.get("spec") or None,
                )
        return options

    def make_skiller_scripts(self) -> dict[str, SkillerScript]:
        """Return the behaviour of each Skiller, by interface id."""
        scripts: dict[str, SkillerScript] = {}
        for scan in self.scans:
            for name, writes in scan.skillers.items():
                scripts.setdefault(name, make_skiller_script(writes))
        # writes first: the statuses that the executive has seen are later, and have no error texts
        for scan in self.scans:
            for name, statuses in scan.statuses.items() if scan.is_timed else ():
                if name not in scripts:
                    shifted_statuses = [
                        structs.replace(status, time_us=status.time_us + scan.shift_us) for status in statuses
                    ]
                    scripts[name] = make_skiller_script(reconstruct_writes(name, shifted_statuses))
        return scripts

    def make_executor_scripts(self) -> list[ExecutorScript]:
        """Return the behaviour of each executor, in order of appearance."""
        scripts: dict[str, ExecutorScript] = {}
        for scan in self.scans:
            for name, writes in scan.executors.items():
                scripts.setdefault(name, make_executor_script(name, writes, scan.messages))
        return list(scripts.values())

    def find_first_writes(self) -> dict[str, InterfaceWrite]:
        """Return the first write of each interface, by ``Type::id``."""
        first_writes: dict[str, InterfaceWrite] = {}
        for scan in self.scans:
            for uid, write in scan.first_writes.items():
                first_writes.setdefault(uid, write)
        return first_writes

    def find_first_sensor_writes(self, *, executors_have_players: bool) -> dict[str, InterfaceWrite]:
        """Return the first write of each interface by ``Type::id``, except those of Skillers and executors.

        :param executors_have_players: whether executors have separate players; else they count as sensors.
        """
        played_types = (SKILLER, EXECUTOR) if executors_have_players else (SKILLER,)
        return {
            uid: write
            for uid, write in self.find_first_writes().items()
            if uid.partition("::")[0] not in played_types
        }

    def read_writes(self, uids: Iterable[str]) -> Iterator[InterfaceWrite]:
        """Yield the writes of interfaces, in the order of their times.

        :param uids: the interfaces, as ``Type::id``.
        """
        # an interface of several recordings is played once, from the first of them
        remaining_uids = set(uids)
        streams = []
        for scan in self.scans:
            uids_of_scan = scan.first_writes.keys() & remaining_uids
            remaining_uids -= uids_of_scan
            streams.append(_read_writes_of(scan, frozenset(uids_of_scan)))
        return heapq.merge(*streams, key=lambda write: write.time_us)


def _is_shipped(scenario: str) -> bool:
    with suppress(OSError, ValueError):
        return Path(scenario).resolve(strict=True).is_relative_to(shipped_dir("scenarios").resolve())
    return False


def _find_decisions(scans: Sequence[Scan]) -> Scan | None:
    """Return the first scan with transitions of goals, otherwise the first with states of Skillers.

    None if no scan has either.
    """
    return next((scan for scan in scans if scan.has_goals), None) or next(
        (scan for scan in scans if scan.statuses), None
    )


def _read_writes_of(scan: Scan, uids: frozenset[str]) -> Iterator[InterfaceWrite]:
    for event in scan.run if uids else ():  # a recording without these interfaces is not read again
        if isinstance(event, InterfaceWrite) and event.uid in uids:
            yield event


def _align_times(scans: Sequence[Scan]) -> None:
    """Set the shift of each text log so that its times fit the times of a recording with dates."""
    # a text log has only the time of day, in an unknown time zone
    dated_scans = [scan for scan in scans if scan.is_timed and not scan.is_log and scan.first_writes]
    if not dated_scans:
        return
    for log in scans:
        if log.is_log:
            distances = (
                distance for scan in dated_scans if (distance := _measure_distance_us(log, scan)) is not None
            )
            # without a common state, both recordings are taken to start at the same time
            distance_us = next(distances, (dated_scans[0].begin_us or 0) - (log.begin_us or 0))
            log.shift_us = round(distance_us / _QUARTER_HOUR_US) * _QUARTER_HOUR_US


def _measure_distance_us(log: Scan, dated_scan: Scan) -> int | None:
    """Return the time of the first common Skiller state in the dated scan, less its time in the log.

    None without a common state.
    """
    for name, statuses in log.statuses.items():
        # in reverse order, so that the first write of a state counts
        times_by_state = {
            (
                write.values.get("skill_string"),
                write.values.get("msgid"),
                write.values.get("status"),
            ): write.time_us
            for write in reversed(dated_scan.skillers.get(name, []))
        }
        for status in statuses:
            time_us = times_by_state.get((status.skill_string, status.msgid, status.status))
            if time_us is not None:
                return time_us - status.time_us
    return None
