"""Plays a run along chosen options while properties are watched, optionally with a recording."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from cxbridge.run.options import RunOptions
from cxbridge.run.recording import start_recording
from cxbridge_explore.playing import ExploredRun
from cxbridge_explore.properties.monitor import Property, Violation
from cxbridge_explore.worldmodel.model import WorldModel
from cxbridge_explore.worlds.points import USUAL, Choice, ChoicePoint, Chooser
from cxbridge_explore.worlds.run import MakeAssembly, make_scenario
from cxbridge_explore.worlds.skills import SkillResult


@dataclass(frozen=True, slots=True)
class NthChoice:
    """A choice, identified independently of the other choices of its run.

    :param subject: the subject of the choice point.
    :param occurrence_index: the number of earlier choice points with this subject.
    :param option: the name of the option.
    """

    subject: str
    occurrence_index: int
    option: str


def unusual_choices(choices: Sequence[Choice]) -> tuple[NthChoice, ...]:
    """Return the unusual choices of a run.

    The choices are not identified by the indices of their points: if one choice is left out, the run has
    other choice points.
    """
    counts: dict[str, int] = {}
    unusual = []
    for choice in choices:
        subject = choice.point.subject
        occurrence_index = counts.get(subject, 0)
        counts[subject] = occurrence_index + 1
        if choice.option_index != USUAL:
            unusual.append(NthChoice(subject, occurrence_index, choice.taken_option.name))
    return tuple(unusual)


class NthChooser:
    """A chooser that takes given options at their choice points, and the usual option elsewhere."""

    def __init__(self, choices: Sequence[NthChoice]) -> None:
        self._options = {(choice.subject, choice.occurrence_index): choice.option for choice in choices}
        self._counts: dict[str, int] = {}

    def choose(self, index: int, point: ChoicePoint) -> int:  # noqa: ARG002 - subjects identify the points
        occurrence_index = self._counts.get(point.subject, 0)
        self._counts[point.subject] = occurrence_index + 1
        option = self._options.get((point.subject, occurrence_index))
        names = [candidate.name for candidate in point.options]
        # the point may lack the option if an earlier choice of the path was left out
        return names.index(option) if option in names else USUAL


@dataclass(frozen=True, slots=True)
class PlayedRun:
    """The record of a played run.

    :param results: the results of the skill calls, in order.
    :param agent_count: the number of agents.
    :param uses_skill_board: whether a skill board executes the skills.
    """

    choices: tuple[Choice, ...]
    violations: tuple[Violation, ...]
    start_us: int
    results: tuple[SkillResult, ...]
    agent_count: int
    uses_skill_board: bool

    def find_violation(self, name: str) -> Violation | None:
        """Return the violation of a property; None if the run does not violate the property."""
        return next((violation for violation in self.violations if violation.property == name), None)


def play_run(
    options: RunOptions,
    properties: Sequence[Property],
    chooser: Chooser,
    trace: Path | None = None,
    *,
    world: WorldModel | None = None,
    make_assembly: MakeAssembly = make_scenario,
    stops_at_violation: bool = False,
) -> PlayedRun:
    """Play a run to its end, or to the first violation of a property.

    :param trace: the file of the recording; None: nothing is recorded.
    :param world: the possible events; None: those of the file in the scenario's folder.
    :param make_assembly: makes the program to run.
    :param stops_at_violation: whether the run ends at the first violation.
    :raises CxbridgeError: if the scenario is invalid, or the file cannot be written.
    """
    if trace is not None:
        options = replace(options, trace=trace, trace_level="facts")
    with ExitStack() as stack:
        run = stack.enter_context(
            ExploredRun(
                options,
                properties,
                chooser,
                world=world,
                make_assembly=make_assembly,
                stops_at_violation=stops_at_violation,
            )
        )
        assembly = run.world.assembly
        stack.callback(start_recording(assembly, options).close)
        # Finalise before the recorder closes, so that the shutdown rules are recorded.
        stack.callback(assembly.finalize)
        start_us = assembly.clock.now_us()
        _, result = run.play()
        uses_skill_board = any(agent.skill_board is not None for agent in assembly.agents)
        return PlayedRun(
            result.choices,
            tuple(run.properties.violations),
            start_us,
            tuple(run.world.skill_results),
            len(assembly.agents),
            uses_skill_board,
        )
