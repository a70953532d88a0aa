"""Comparisons with the golden run of the test scenario find each mutant of the scenario."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from shutil import copytree

import pytest

from cxbridge.event_kinds import View
from cxbridge.history.transitions import Transition
from cxbridge.run.options import RunOptions
from cxbridge.testing.agent_run import AgentRun
from cxbridge.testing.golden import compare_with_golden, write_golden
from cxbridge.trace.compare.model import Order
from cxbridge.trace.formats.transitions_text import TransitionsWriter
from tests.support import ROOT

SCENARIO = ROOT / "scenarios" / "test-scenario"

SECONDS = 20.0
"""Duration of a mutant's run: the scenario ends after ten seconds, some mutants never end."""

TOLERANCE_S = 0.05


@dataclass(frozen=True)
class Mutant:
    """An edit of one file of the scenario.

    :param needs: comparison beside the transitions that finds the mutant: ``values``, ``times`` or nothing.
    """

    name: str
    file: str
    old: str
    new: str
    needs: str = ""

    def make(self, folder: Path) -> Path:
        """Make the mutant in a folder."""
        copytree(SCENARIO, folder)
        text = (folder / self.file).read_text()
        assert text.count(self.old) == 1
        (folder / self.file).write_text(text.replace(self.old, self.new))
        return folder


PLANS, GOALS, LEAVES = "talk-plans.clp", "talk-goals.clp", "talk-leaves.clp"
LEAF = "(assert (goal (class ?class) (id ?id)"
FAILED = "(modify ?goal (mode FINISHED) (outcome FAILED))"

MUTANTS = [
    Mutant("a value of a parameter", PLANS, "This is a print test", "This is not a print test", "values"),
    Mutant("another parameter", PLANS, "(create$ warn (str-cat", "(create$ info (str-cat", "values"),
    Mutant("a parameter of a goal", GOALS, "SUBGOAL 3 (talk", "SUBGOAL 4 (talk", "values"),
    Mutant("meta data of a goal", LEAVES, "(meta tried-once))", "(meta tried-once yes))", "values"),
    Mutant("priority of a goal", GOALS, LEAF, f"{LEAF} (priority 7.0)", "values"),
    Mutant(
        "time",
        GOALS,
        "?mode&FORMULATED|SELECTED|FINISHED|EVALUATED))",
        "?mode&FORMULATED|SELECTED|FINISHED|EVALUATED)) (time ? ?us&:(> ?us 900000))",
        "times",
    ),
    Mutant("a required resource", GOALS, LEAF, f"{LEAF} (required-resources arm)"),
    Mutant("an argument of a skill", "scenario.yaml", '"Good bye", wait=true', '"Good bye", wait=false'),
    Mutant("the order of actions", PLANS, "?goal 2 print", "?goal 6 print"),
    Mutant("a dropped action", PLANS, "(talk-step ?goal 5 say-cleanup (create$) (create$))", ""),
    Mutant(
        "a precondition without its not",
        "domain.pddl",
        ":precondition (not (said ?name hello))",
        ":precondition (said ?name hello)",
    ),
    Mutant(
        "a salience that changes the order",
        LEAVES,
        "(defrule talk-player-fail\n",
        "(defrule talk-player-fail\n (declare (salience -1500))\n",
    ),
    Mutant("the error of a goal", LEAVES, FAILED, f"{FAILED[:-1]} (error BROKEN))"),
    Mutant("the outcome of a goal", LEAVES, "(outcome REJECTED)", "(outcome FAILED)"),
    Mutant("the kind of a goal", GOALS, "(goal-tree-assert-try-all", "(goal-tree-assert-run-all"),
]


def transitions_of(folder: Path) -> Sequence[Transition]:
    with AgentRun(RunOptions(scenario=folder, skiller="none"), scripted=True) as run:
        run.skills("say").succeeds(after=1.0)
        run.advance(SECONDS)
        return run.transitions


@pytest.fixture(scope="module")
def golden(tmp_path_factory) -> Path:
    """Three files of the same run: with values and times, with values, and as they were before values."""
    folder: Path = tmp_path_factory.mktemp("golden")
    transitions = transitions_of(SCENARIO)
    write_golden(folder / "times", transitions, 0)
    write_golden(folder / "values", transitions)
    with TransitionsWriter(folder / "old") as writer:
        for transition in transitions:
            writer.write(transition)
    return folder


@pytest.fixture(scope="module", params=MUTANTS, ids=lambda mutant: mutant.name)
def mutated(request, tmp_path_factory) -> tuple[Mutant, Sequence[Transition]]:
    """A mutant, and the transitions of its run."""
    mutant: Mutant = request.param
    return mutant, transitions_of(mutant.make(tmp_path_factory.mktemp("mutants") / "mutant"))


@pytest.fixture(scope="module")
def rerun() -> Sequence[Transition]:
    """The transitions of a second run of the scenario itself."""
    return transitions_of(SCENARIO)


def differs(
    file: Path, transitions: Sequence[Transition], order: Order, tolerance_s: float | None = None
) -> bool:
    """Whether a run differs from a golden run."""
    start_us = None if tolerance_s is None else 0
    return bool(
        compare_with_golden(
            file,
            transitions,
            view=View.TRANSITIONS,
            order=order,
            tolerance_s=tolerance_s,
            start_us=start_us,
        )
    )


@pytest.mark.parametrize("order", Order)
def test_mutant_differs_from_golden_run(mutated, order, golden):
    mutant, transitions = mutated
    assert differs(golden / "times", transitions, order, TOLERANCE_S)
    assert differs(golden / "values", transitions, order) == (mutant.needs != "times")
    # an earlier version found 9 of 15
    assert differs(golden / "old", transitions, order) == (mutant.needs == "")


@pytest.mark.parametrize("order", Order)
def test_scenario_equals_golden_run(order, golden, rerun):
    for file, tolerance_s in (("times", 0.0), ("values", None), ("old", None)):
        assert not differs(golden / file, rerun, order, tolerance_s)
