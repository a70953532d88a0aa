"""The built-in core against Fawkes' own, over generated trees of goals: the same transitions and skills."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from cxbridge.app import RunOptions, run_scenario
from cxbridge.events import SkillStatus
from cxbridge.trace.compare.report import make_report, text_report
from cxbridge.trace.compare.result import Order
from cxbridge.trace.compare.runs import compare_runs
from cxbridge.trace.compare.select import Selection
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.levels import View
from tests.app.mini import write_scenario
from tests.support import FAWKES_DIR, many, needs_fawkes

FILES = (
    "goal-tree.clp, goals/automatic.clp, goals/retry.clp, goals/run-all.clp, goals/run-one.clp, "
    "goals/try-all.clp, goals/timeout.clp, goals/run-parallel.clp, mini.clp, "
    "action-selection/sequential.clp, skills-actions.clp"
)

AGENT = """
(defrule begin (executive-initialized) (not (begun)) =>
  (assert (begun) (skiller-control (skiller "Skiller")))
  (assert (domain-operator (name good) (param-names text)) (domain-operator (name bad) (param-names text)))
  {tree})
(defrule select ?g <- (goal (mode FORMULATED) (parent nil)) (skiller-control (acquired TRUE)) =>
  (modify ?g (mode SELECTED)))
(defrule reject ?g <- (goal (class NO) (mode SELECTED)) => (modify ?g (mode FINISHED) (outcome REJECTED)))
(deffunction plan-one (?id ?number ?action)
  (assert (plan-action (id ?number) (plan-id P) (goal-id ?id) (action-name ?action) (param-names text)
                       (param-values (str-cat ?id "-" ?number)) (executable TRUE))))
(defrule plan ?g <- (goal (id ?id) (class ?class&GOOD|BAD|TWO) (mode SELECTED)) =>
  (assert (plan (id P) (goal-id ?id) (type SEQUENTIAL)))
  (plan-one ?id 1 (if (eq ?class BAD) then bad else good))
  (if (eq ?class TWO) then (plan-one ?id 2 good))
  (modify ?g (mode EXPANDED)))
(defrule commit ?g <- (goal (sub-type nil) (mode EXPANDED)) => (modify ?g (mode COMMITTED) (committed-to P)))
(defrule dispatch ?g <- (goal (sub-type nil) (mode COMMITTED)) => (modify ?g (mode DISPATCHED)))
(defrule expand ?g <- (goal (class TREE) (sub-type ~nil&~RETRY-SUBGOAL&~TIMEOUT-SUBGOAL) (mode SELECTED)) =>
  (modify ?g (mode EXPANDED)))
(defrule evaluate ?g <- (goal (mode FINISHED)) => (modify ?g (mode EVALUATED)))
(defrule retract ?g <- (goal (parent nil) (mode EVALUATED)) => (modify ?g (mode RETRACTED)))
"""
MAPPING = """good: say{text=?(text)s}
        bad: nothing_like_this{text=?(text)s}"""
MANY = ("run-all TREE", "run-one TREE", "try-all TREE")
PARALLEL = tuple(
    f"run-parallel{late} TREE {on}" for late in ("", "-delayed") for on in ("NONE", "FAILED", "REJECTED")
)
ONE = ("retry TREE 2", "retry TREE 3", "timeout TREE 1000", "timeout TREE 2")


def tree(random: Random, depth: int = 3) -> str:
    """A tree of goals as an expression of CLIPS; its leaves are called L0, L1 ... in its order.

    Parallel goals have leaves only: the cores do not always agree on whose leaves get the one Skiller first.
    """
    names = iter(f"L{number}" for number in range(10_000))

    def grow(left: int) -> str:
        if left == 0 or (left < depth and random.random() < 0.4):
            kind = random.choices(("GOOD", "TWO", "BAD", "NO"), (5, 2, 2, 1))[0]
            return f"(assert (goal (id {next(names)}) (class {kind})))"
        if random.random() < 0.25:
            return f"(goal-tree-assert-{random.choice(ONE)} {grow(left - 1)})"
        kind = random.choice(MANY + PARALLEL)
        below = 0 if kind in PARALLEL else left - 1
        children = [grow(below) for _ in range(random.randint(1, 3))]
        return f"(goal-tree-assert-{kind} {' '.join(children)})"

    return grow(depth)


def record(folder: Path, text: str, core: str) -> Path:
    """Run a tree with a core; return the recording."""
    scenario = write_scenario(folder / core, agent=AGENT.format(tree=text), mapping=MAPPING)
    config = scenario / "scenario.yaml"
    before = config.read_text()
    listed = before[before.index("[mini.clp") + 1 : before.index("]", before.index("[mini.clp"))]
    config.write_text(
        before.replace(listed, FILES).replace("  spec: mini\n", "  exact-retry: true\n  spec: mini\n", 1)
    )
    target = folder / f"{core}.mcap"
    fawkes = FAWKES_DIR if core == "fawkes" else None
    run_scenario(
        RunOptions(scenario=scenario, fawkes_dir=fawkes, trace=target, timeout=60, trace_files=False)
    )
    return target


@needs_fawkes
@pytest.mark.parametrize("seed", range(many(26, 6)))
def test_both_cores_take_the_same_way_through_a_tree(seed: int, tmp_path: Path) -> None:
    text = tree(Random(seed))
    ours, theirs = record(tmp_path, text, "builtin"), record(tmp_path, text, "fawkes")
    run, other = open_run(theirs), open_run(ours)
    found = compare_runs(run, [other], View("transitions"), Order("partial"))
    assert found.same, "\n".join([text, *text_report(make_report(found, run, [other], Selection((), ())))])
    assert skills(ours) == skills(theirs), text


def skills(path: Path) -> list[tuple[str, str]]:
    """What the Skiller did, in total order."""
    return [(each.skill_string, each.status) for each in open_run(path) if isinstance(each, SkillStatus)]
