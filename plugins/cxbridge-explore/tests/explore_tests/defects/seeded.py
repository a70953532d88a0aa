"""Seeded defects: replaced lines in copies of correct agents."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cxbridge.run.options import RunOptions
from cxbridge_explore.counterexample_playing import PlayedRun, play_run
from cxbridge_explore.properties.builtin.table import builtin_properties
from cxbridge_explore.properties.forms import read_property
from cxbridge_explore.properties.monitor import Property
from cxbridge_explore.worlds.points import USUAL, ChoicePath, PathChooser, Step
from tests.support import ROOT

DELIVERED = (
    "delivered: after (goal (class DELIVER) (mode EVALUATED) (outcome COMPLETED))"
    " then (domain-fact (name at) (param-values cup table))"
)


@dataclass(frozen=True)
class Defect:
    """A defect of an agent.

    :param name: a short description.
    :param folder: the folder of the correct agent.
    :param changes: file, old text, and new text.
    :param found_by: the violated property.
    :param faults: the number of faults of the shortest path.
    :param own: a property in addition to the built-in properties.
    """

    name: str
    folder: Path
    changes: tuple[tuple[str, str, str], ...]
    found_by: str
    faults: int
    own: str = ""
    agent: str | None = None

    def copy(self, folder: Path, *, broken: bool) -> Path:
        """Copy the agent to a folder, with or without the defect."""
        shutil.copytree(self.folder, folder)
        for file, correct, defective in self.changes if broken else ():
            text = (folder / file).read_text()
            assert text.count(correct) == 1, (
                f"{self.folder / file} does not have the text that the defect replaces"
            )
            (folder / file).write_text(text.replace(correct, defective))
        return folder

    def options(self, folder: Path) -> RunOptions:
        """Return the options of the agent's runs."""
        return RunOptions(scenario=folder, skiller="none", agent=self.agent, timeout=60.0)

    @property
    def properties(self) -> tuple[Property, ...]:
        """The watched properties."""
        return (*builtin_properties(), *([read_property(self.own)] if self.own else []))


DEFECTS = (
    Defect(
        "a lock is not released after a failure",
        ROOT / "scenarios" / "two-agents",
        (
            (
                "house-locks.clp",
                "(mutex-unlock-async tap))\n\n(defrule tap-released",
                "(assert (kept)))\n\n(defrule tap-released",
            ),
        ),
        "run-ends",
        1,
        agent="robot1",
    ),
    Defect(
        "a retry without end",
        ROOT / "scenarios" / "test-scenario-pddl",
        (
            ("meet-goals.clp", "(meet-tries ?number&:(< ?number ?*MEET-MAX-TRIES*))", "(meet-tries ?number)"),
            (
                "meet-goals.clp",
                "(defrule meet-try-again\n",
                "(defrule meet-try-again (declare (salience 1))\n",
            ),
        ),
        "three-tries",
        3,
        own="three-tries: never (meet-tries 4)",
    ),
    Defect(
        "an action runs twice after a takeover",
        ROOT / "scenarios" / "two-agents",
        (
            ("house-plan.clp", "(if (not (house-is swept ?room)) then", "(if TRUE then"),
            ("domain.pddl", ":precondition (not (swept ?room))\n", ":precondition (and)\n"),
        ),
        "executed-once",
        1,
        agent="robot1",
    ),
    Defect(
        "a goal is stuck in EXPANDED",
        ROOT / "scenarios" / "test-scenario-pddl",
        (("meet-goals.clp", "(mode EXPANDED))\n", "(mode EXPANDED))\n  (meet-tries 1)\n"),),
        "goals-retracted",
        1,
    ),
    Defect(
        "an order is delivered to the wrong place",
        ROOT / "templates" / "courier" / "courier",
        (
            (
                "courier.clp",
                '(planner-plan ?id "(at cup table)")',
                (
                    "(planner-plan ?id (if (any-factp ((?t tries)) (eq ?t:implied (create$ 1)))"
                    ' then "(at cup table)" else "(at cup kitchen)"))'
                ),
            ),
        ),
        "delivered",
        1,
        own=DELIVERED,
    ),
)


def play_runs(
    options: RunOptions, properties: tuple[Property, ...], faults: int
) -> Iterator[tuple[ChoicePath, PlayedRun]]:
    """Yield all runs with at most ``faults`` faults, those with the fewest faults first."""
    paths: list[ChoicePath] = [{}]
    for number in range(faults + 1):
        longer: list[ChoicePath] = []
        for path in paths:
            played = play_run(options, properties, PathChooser(path))
            yield path, played
            after = max(path, default=-1)
            longer += [
                {**path, choice.point.index: Step(choice.point.subject, option.name)}
                for choice in played.choices
                for place, option in enumerate(choice.point.options)
                if choice.point.index > after and place != USUAL and number < faults
            ]
        paths = longer
