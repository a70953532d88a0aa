"""Replay of a recorded environment, and the comparison of the run's decisions."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import MICROSECONDS, VirtualClock
from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel, View
from cxbridge.events import Event, EventBus, RuleFired, SkillStatus
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.run.components.skill_board import SkillBoardComponent
from cxbridge.run.components.skillers import Skillers
from cxbridge.run.options import RunOptions
from cxbridge.run.paths import find_fawkes_interface_dirs
from cxbridge.run.replay.divergence import PATIENCE_US, Divergence, Expectation
from cxbridge.run.replay.executors import RecordedExecutor
from cxbridge.run.replay.recordings import Recordings
from cxbridge.run.replay.scan import SKILLER, Scan
from cxbridge.run.replay.script import Command, ExecutorScript, RecordedExecution, SkillerScript
from cxbridge.run.replay.sensors import SensorPlayer, YieldingBoard
from cxbridge.run.replay.skillers import COMPONENT, RecordedSkiller
from cxbridge.run.result import ReplayOutcome
from cxbridge.run.skillers import skiller_settings
from cxbridge.skiller.board.executor import ExecutorContext
from cxbridge.skiller.board.host import ExecutorHost
from cxbridge.trace.compare.model import Order
from cxbridge.trace.compare.render.json import report_to_json
from cxbridge.trace.compare.render.text import make_report, text_report
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.formats.base import Run as Recording
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.recorder import Recorder
from cxbridge.trace.replay.block_maker import BlockMaker


def judge(
    transitions_file: Path,
    decisions: Scan,
    order: Order,
    divergence: Divergence | None,
    *,
    is_complete: bool,
) -> ReplayOutcome:
    """Return the result of a replay: compare the run with the recorded run.

    :param transitions_file: the file with this run's transitions.
    :param decisions: the recording with the decisions to compare.
    :param divergence: the first command that differed, which makes a comparison of transitions needless; None
        without a difference.
    :param is_complete: whether the recording reaches the end of its run; otherwise only its time span is
        compared.
    :raises TraceError: if a recording cannot be read, or has nothing to compare.
    """
    compared = str(decisions.run.path)
    if divergence is not None:
        return ReplayOutcome(compared, order.value, divergence, same=False, is_complete=is_complete)
    view = View.TRANSITIONS if decisions.has_goals else View.SKILLS
    run, recorded = open_run(transitions_file), decisions.run
    if not is_complete:
        run, recorded = _cut_recordings(run, recorded, view, order)
    if not _count_events(run, view.event_types):
        return ReplayOutcome(
            compared,
            order.value,
            None,
            same=False,
            is_complete=is_complete,
            lines=("It has no events that can be compared.",),
        )
    comparison = compare_runs(run, [recorded], view, order)
    report = make_report(comparison, run, [recorded])
    lines, json_report = tuple(text_report(report)), report_to_json(report)
    return ReplayOutcome(compared, order.value, None, comparison.same, is_complete, lines, json_report)


def _cut_recordings(
    run: Recording, recorded: Recording, view: View, order: Order
) -> tuple[Recording, Recording]:
    """Return the comparable starts of a run and of its incomplete recording.

    :raises TraceError: if the recording has nothing to compare.
    """
    # in partial order, the recording may lack the last transitions of any goal; the states of Skillers have
    # one order, so they mark the cut
    types = view.event_types if order is Order.TOTAL else (SkillStatus,)
    count = _count_events(recorded, types)
    if not count:
        raise TraceError(
            "it ends before the first state of a Skiller, so nothing can be compared in partial order",
            file=recorded.path,
            hint="--replay-order total compares the events that exist",
        )
    if order is Order.PARTIAL:
        # both are cut at the same state, also if the run has had fewer states
        count = min(count, _count_events(run, types))
    return RunHead(run, count, types), RunHead(recorded, count, types)


def _count_events(run: Recording, types: tuple[type[Event], ...]) -> int:
    return sum(isinstance(event, types) for event in run)


class RunHead(Recording):
    """The start of a run, up to a number of events.

    :param count: the number of events of ``types`` that belong to the start.
    """

    def __init__(self, run: Recording, count: int, types: tuple[type[Event], ...]) -> None:
        super().__init__(run.path)
        self.format = run.format
        self._run, self._count, self._types = run, count, types

    def __iter__(self) -> Iterator[Event]:
        remaining = self._count
        for event in self._run:
            if isinstance(event, self._types):
                if not remaining:
                    return
                remaining -= 1
            elif not remaining and isinstance(event, TRANSITION_TYPES):
                return  # the recording may lack transitions after the last counted event
            yield event


# The extra time for the last transitions: the rules may need more cycles than in the recorded run.
_SLACK_US: Final = 2 * MICROSECONDS


class _TransitionWriter(McapWriter):
    """Keeps the transitions for the comparison, and rule firings for the report about a difference."""

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:  # noqa: ARG002 - always the same
        return frozenset((*TRANSITION_TYPES, RuleFired))


class Replay:
    """The environment of a recorded run.

    :param order: the order in which transitions are compared.
    """

    board_class: type[LocalBlackBoard] = YieldingBoard

    def __init__(self, recordings: Recordings, order: Order) -> None:
        self.recordings, self._order = recordings, order
        self.divergence: Divergence | None = None
        """The first divergence."""
        self.clock = VirtualClock(recordings.start_us)
        """The run's clock, which starts at the recorded start."""
        self._expectations: list[Expectation[Command] | Expectation[RecordedExecution]] = []
        self._skillers: list[RecordedSkiller] = []
        self._has_sensors = False
        self._last_us = 0
        self._quiet_us: int | None = None  # since when all recorded commands are met
        self._outcome: ReplayOutcome | None = None

    @property
    def length_us(self) -> int:
        """The time from the recorded start to the last transition or skill status; 0 if unknown."""
        return max(0, self.recordings.end_us - self.recordings.start_us)

    @contextmanager
    def compare_decisions(self, bus: EventBus) -> Iterator[None]:
        """Record the transitions of this run, and compare them when the context ends.

        :raises TraceError: if a recording cannot be read, or has nothing to compare.
        """
        with tempfile.TemporaryDirectory(prefix="cxbridge-replay-") as folder:
            file = Path(folder) / "this run"  # reports name a run by its file
            with Recorder(bus, [_TransitionWriter(file)]):
                yield
            recordings = self.recordings
            self._outcome = judge(
                file,
                recordings.decisions,
                self._order,
                self.divergence,
                is_complete=recordings.is_complete,
            )

    def components(self, context: Run) -> Iterator[Component]:
        """Make the players of Skillers, executors and sensors.

        :raises CxbridgeError: if an interface has changed since the recording, or cannot be written.
        """
        settings = context.skill_board
        scripts = self.recordings.make_executor_scripts() if settings is not None else []
        recorded_names = {script.agent for script in scripts}
        agents = tuple(
            agent for agent in (settings.agents if settings else ()) if agent.name in recorded_names
        )
        yield self._make_skillers(context, {agent.skiller for agent in agents})
        if settings is not None:
            skill_board = SkillBoardComponent(context, replace(settings, agents=agents, in_process=False))
            yield skill_board
            for script in scripts:
                skill_board.service.add(self._make_executor_host(context, script))
        first_writes = self.recordings.find_first_sensor_writes(executors_have_players=settings is not None)
        self._has_sensors = bool(first_writes)
        assert isinstance(context.board, YieldingBoard)
        yield SensorPlayer(
            context.board,
            context.bus.logger(COMPONENT),
            first_writes,
            self.recordings.read_writes(first_writes),
        )

    def _make_skillers(self, context: Run, board_skillers: set[str]) -> Skillers:
        """Make the recorded Skillers.

        :param board_skillers: the names of the Skillers that the skill board serves; they are left out.
        :raises TraceError: if the interface has changed since the recording.
        """
        scripts = {
            name: script
            for name, script in self.recordings.make_skiller_scripts().items()
            if name not in board_skillers
        }
        # a Skiller without recorded commands is made, too: rules may wait for its interface
        for settings in skiller_settings(context.config, "lua", board_skillers):
            scripts.setdefault(settings.name, SkillerScript())
        block_maker = BlockMaker(context.board.registry.get(SKILLER))
        for uid, write in self.recordings.find_first_writes().items():
            if uid.startswith(f"{SKILLER}::"):
                block_maker.check_fields(write.values, uid)
        self._skillers = [
            self._make_recorded_skiller(context, name, script) for name, script in scripts.items()
        ]
        return Skillers(context, self._skillers)

    def _make_recorded_skiller(self, context: Run, name: str, script: SkillerScript) -> RecordedSkiller:
        player = RecordedSkiller(
            context.board,
            context.bus,
            name,
            script,
            start_us=self.recordings.start_us,
            is_complete=self.recordings.is_complete,
            report=self.record_divergence,
        )
        self._expectations.append(player.expectation)
        for command in script.commands:
            self._record_time(
                command.time_us + max((after_us for after_us, _ in command.later_writes), default=0)
            )
        return player

    def _make_executor_host(self, context: Run, script: ExecutorScript) -> ExecutorHost:
        executor = RecordedExecutor(
            ExecutorContext(script.agent, context.board, context.clock, context.bus.logger(COMPONENT)),
            script,
            start_us=self.recordings.start_us,
            is_complete=self.recordings.is_complete,
            report=self.record_divergence,
        )
        self._expectations.append(executor.expectation)
        for execution in script.executions:
            self._record_time(execution.time_us + (execution.duration_us or 0))
        return ExecutorHost(executor, script.name)

    def _record_time(self, time_us: int) -> None:
        """Update the time of the last recorded action."""
        self._last_us = max(self._last_us, time_us)

    def record_divergence(self, divergence: Divergence) -> None:
        """Record a divergence; only the first counts."""
        self.divergence = self.divergence or divergence

    def is_over(self, now_us: int, *, run_is_over: bool) -> bool:
        """Return whether the replay is over. To be called after each loop.

        :param run_is_over: whether the run itself has ended.
        """
        if self.divergence is not None or any(expectation.is_exhausted for expectation in self._expectations):
            return True
        if any(skiller.running for skiller in self._skillers) or any(
            expectation.expected is not None for expectation in self._expectations
        ):
            self._quiet_us = None
            return False
        if self._quiet_us is None:
            self._quiet_us = now_us
        # after the last recorded command, the rules get the time that they had in the recorded run
        end_us, slack_us = self._quiet_us, PATIENCE_US
        if self.recordings.end_us:
            slack_us = _SLACK_US
            end_us += max(0, self.recordings.end_us - max(self._last_us, self.recordings.start_us))
            # recorded sensors may cause decisions until the last recorded transition
            end_us = max(end_us, self.recordings.end_us if self._has_sensors else 0)
        return now_us >= (end_us if run_is_over else end_us + slack_us)

    def outcome(self) -> ReplayOutcome:
        """Return the result of the comparison, after the context of :meth:`compare_decisions` has ended."""
        assert self._outcome is not None
        return self._outcome


def open_replay(options: RunOptions) -> tuple[RunOptions, Replay]:
    """Read the recordings of the options.

    :returns: the options, completed by :meth:`Recordings.complete_options`, and the replay.
    :raises CxbridgeError: if the recordings cannot be replayed or the options are wrong.
    """
    interface_dirs = list(options.interface_dirs)
    if options.fawkes_dir is not None:
        interface_dirs += find_fawkes_interface_dirs(options.fawkes_dir)
    recordings = Recordings.read(options.replay, InterfaceRegistry(interface_dirs))
    options = recordings.complete_options(options)
    options.check()
    return options, Replay(recordings, Order(options.replay_order))
