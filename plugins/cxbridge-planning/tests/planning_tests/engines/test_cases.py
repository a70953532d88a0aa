"""The PDDL cases of ../shared/cases/files, with plans or refusals."""

from __future__ import annotations

import pytest

from cxbridge.cli.main import invoke
from cxbridge_planning.registry import make_planner
from tests.support import SHARED, needs_shared

CASE_FOLDER = SHARED / "cases" / "files"
CASES = sorted(path.parent.name for path in CASE_FOLDER.glob("*/problem.pddl"))
DROP = "(drop l1 b1)\n"
PLANS = {
    "costs-ignored": "(cheap1)\n(cheap2)\n",
    "dash-type": DROP,
    "either-empty-group": DROP,
    "init-not": DROP,
    "latin1": DROP,
    "metric-total-time": "(go x y) [4.000]\n",
    "nested-forall-effect": "(mop)\n",
    "numeric-preconditions": "(burn r1)\n",
    "one-typing-missing": DROP,
    "type-name-is-object-name": "(bake oven bread) [5.000]\n",
    "upper-case": "(put A B)\n",
    "aries-crash-message": "(ask b h1 d1) [5.000]\n",
}
"""The plans, without the start times of steps."""

REFUSALS = {
    "derived": "domain.pddl:5:3: derived predicates are not supported",
    "preference-message": "problem.pddl:1:78: preferences are not supported",
    "wrong-hint-object": "declare it in (:objects ...) of the problem",
}
BEYOND_PYPERPLAN = {"costs-ignored", "metric-total-time", "numeric-preconditions", "type-name-is-object-name"}
"""The cases that need aries or lpg."""

CRASH_ARIES = {"aries-crash-message", "nested-forall-effect"}
"""The cases that crash aries and need lpg."""


def is_installed(name: str) -> bool:
    return not make_planner(name).unavailable_reason


@needs_shared
def test_tables_have_each_case():
    assert {*PLANS, *REFUSALS} == {*CASES}


@needs_shared
@pytest.mark.parametrize("name", PLANS)
def test_case_is_planned(name, capsys):
    if name in BEYOND_PYPERPLAN and not (is_installed("aries") or is_installed("lpg")):
        pytest.skip("no engine is installed")
    status = invoke(
        ["plan", str(CASE_FOLDER / name / "domain.pddl"), str(CASE_FOLDER / name / "problem.pddl"), "-v"]
    )
    out, errors = capsys.readouterr()
    if name in CRASH_ARIES and not is_installed("lpg"):
        reason = "its server no longer answers" if is_installed("aries") else "no planner supports"
        assert status in (2, 4)
        assert reason in errors
        return
    assert (status, "".join(line.rpartition(": ")[2] for line in out.splitlines(keepends=True))) == (
        0,
        PLANS[name],
    ), errors


@needs_shared
@pytest.mark.parametrize("name", REFUSALS)
def test_case_is_refused(name, capsys):
    assert (
        invoke(["plan", str(CASE_FOLDER / name / "domain.pddl"), str(CASE_FOLDER / name / "problem.pddl")])
        == 2
    )
    assert REFUSALS[name] in capsys.readouterr().err
