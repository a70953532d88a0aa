"""Plays a run along chosen options while properties are watched, optionally with a recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
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

# The names of unusual options, by the subject of the choice point and the number of earlier choice points
# with this subject. Indices cannot identify the points: a run without one of the choices has other indices.
NthChoices = Mapping[tuple[str, int], str]


def find_unusual_choices(choices: Sequence[Choice]) -> NthChoices:
    """Return the unusual choices of a run."""
    counts: Counter[str] = Counter()
    unusual_options = {}
    for choice in choices:
        subject = choice.point.subject
        if choice.option_index != USUAL:
            unusual_options[subject, counts[subject]] = choice.taken_option.name
        counts[subject] += 1
    return unusual_options


class NthChooser:
    """A chooser that takes given options at their choice points, and the usual option elsewhere."""

    def __init__(self, choices: NthChoices) -> None:
        self._choices = choices
        self._counts: Counter[str] = Counter()

    def choose(self, point: ChoicePoint) -> int:
        option_name = self._choices.get((point.subject, self._counts[point.subject]))
        self._counts[point.subject] += 1
        names = [candidate.name for candidate in point.options]
        # the point may lack the option if an earlier choice of the path was left out
        return names.index(option_name) if option_name in names else USUAL


@dataclass(frozen=True, slots=True)
class PlayedRun:
    """The record of a played run.

    :param choices: all choices, in order.
    :param start_us: the run's clock at the start, in microseconds since the epoch.
    :param skill_results: the results of the skill calls, in order.
    :param agent_count: the number of agents.
    :param uses_skill_board: whether a skill board executes the skills.
    """

    choices: tuple[Choice, ...]
    violations: tuple[Violation, ...]
    start_us: int
    skill_results: tuple[SkillResult, ...]
    agent_count: int
    uses_skill_board: bool


def play_run(
    options: RunOptions,
    properties: Sequence[Property],
    chooser: Chooser,
    recording: Path | None = None,
    *,
    world: WorldModel | None = None,
    make_assembly: MakeAssembly = make_scenario,
) -> PlayedRun:
    """Play a run to its end, or to the first violation of a property.

    :param recording: the file for a recording of the run; None for no recording.
    :param world: the possible events; None for the file in the scenario's folder.
    :param make_assembly: makes the program to run.
    :raises CxbridgeError: if the scenario is invalid, or the file cannot be written.
    """
    if recording is not None:
        options = replace(options, trace=recording, trace_level="facts")
    with ExitStack() as stack:
        run = stack.enter_context(
            ExploredRun(
                options,
                properties,
                chooser,
                world=world,
                make_assembly=make_assembly,
                stops_at_violation=True,
            )
        )
        assembly = run.assembly
        stack.callback(start_recording(assembly, options).close)
        # Finalise before the recorder closes, so that the shutdown rules are recorded.
        stack.callback(assembly.finalize)
        start_us = assembly.clock.now_us()
        return PlayedRun(
            run.play().choices,
            tuple(run.property_watch.violations),
            start_us,
            tuple(run.skill_results),
            len(assembly.agents),
            any(agent.skill_board is not None for agent in assembly.agents),
        )
