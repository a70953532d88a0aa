"""Plays a path of choices under the eyes of properties, with a recording if one is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from cxbridge.history.builder import UNLIMITED, RunHistory
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.run.options import RunOptions
from cxbridge.run.recording import start_recording
from cxbridge_explore.playing import ExploredRun
from cxbridge_explore.properties.monitor import Property, Violation
from cxbridge_explore.worldmodel.model import WorldModel
from cxbridge_explore.worlds.points import USUAL, Choice, ChoicePoint, Chooser
from cxbridge_explore.worlds.run import MakeAssembly, make_scenario
from cxbridge_explore.worlds.skills import SkillAnswer


@dataclass(frozen=True, slots=True)
class Wanted:
    """A choice of a path, named so that it can be found in another run, too.

    :param subject: of its choice point.
    :param nth: which one of the points with that subject, from 0.
    :param option: the option.
    """

    subject: str
    nth: int
    option: str


def wanted(choices: Sequence[Choice]) -> tuple[Wanted, ...]:
    """Return the choices of a run that are not the usual ones."""
    counts: dict[str, int] = {}
    found = []
    for choice in choices:
        subject = choice.point.subject
        nth = counts.get(subject, 0)
        counts[subject] = nth + 1
        if choice.option != USUAL:
            found.append(Wanted(subject, nth, choice.taken.name))
    return tuple(found)


class WantedChooser:
    """Takes the wanted choices where they come, and the usual ones elsewhere."""

    def __init__(self, choices: Sequence[Wanted]) -> None:
        self._options = {(each.subject, each.nth): each.option for each in choices}
        self._counts: dict[str, int] = {}

    def choose(self, index: int, point: ChoicePoint) -> int:  # noqa: ARG002 - points are named by subjects
        """Return the wanted option at the next point of a subject."""
        nth = self._counts.get(point.subject, 0)
        self._counts[point.subject] = nth + 1
        option = self._options.get((point.subject, nth))
        names = [each.name for each in point.options]
        return names.index(option) if option in names else USUAL


@dataclass(frozen=True, slots=True)
class Played:
    """A run that was played.

    :param choices: all that were taken.
    :param violations: of the properties.
    :param history: goals, actions and skills.
    :param start_us: when it began.
    :param answers: how the calls of skills ended.
    :param agents: how many there are.
    :param on_board: whether skills are executed on a skill board.
    """

    choices: tuple[Choice, ...]
    violations: tuple[Violation, ...]
    history: RunHistory
    start_us: int
    answers: tuple[SkillAnswer, ...]
    agents: int
    on_board: bool

    def violation(self, name: str) -> Violation | None:
        """Return how a property is violated; None when it is not."""
        return next((each for each in self.violations if each.property == name), None)


def play(
    options: RunOptions,
    properties: Sequence[Property],
    chooser: Chooser,
    trace: Path | None = None,
    *,
    world: WorldModel | None = None,
    make: MakeAssembly = make_scenario,
    briefly: bool = False,
) -> Played:
    """Play a run to its end.

    :param world: the possible events; None: the file in the scenario's folder.
    :param make: makes the program to run.
    :param briefly: only until a property is violated.
    :param trace: the file that it is recorded to.
    :raises CxbridgeError: when the scenario is wrong, or the file cannot be written.
    """
    if trace is not None:
        options = replace(options, trace=trace, trace_level="facts")
    with ExitStack() as stack:
        run = stack.enter_context(
            ExploredRun(options, properties, chooser, world=world, make=make, briefly=briefly)
        )
        assembly = run.world.assembly
        history = RunHistory(UNLIMITED, assembly.clock.now_us())
        assembly.bus.subscribe(history.take, *TRANSITION_TYPES)
        stack.callback(start_recording(assembly, options).close)
        stack.callback(assembly.finalize)  # before the recorder: the rules' good-bye belongs to the run
        start_us = assembly.clock.now_us()
        _, result = run.play()
        on_board = any(agent.skill_board is not None for agent in assembly.agents)
        return Played(
            result.choices,
            tuple(run.properties.violations),
            history,
            start_us,
            tuple(run.world.answers),
            len(assembly.agents),
            on_board,
        )
