"""The built-in core against Fawkes' own: the same transitions, in the same order, for the same agents."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.run.core_malformed import CHANGES, MALFORMED, SINGLE, SUB_TYPES, agent, make_meddling_agent
from tests.run.core_trees import first_difference, make_agent, run_both
from tests.support import FAWKES_DIR, FULL, many, needs_fawkes

pytestmark = needs_fawkes

ONCE_DIFFERENT = (141, 185, 208, 342)
"""Seeds of trees that found something since the first parallel goals with trees below them."""

LIMITS = "RETRY and TIMEOUT want a limit above zero"
NAMES = "two facts of one id: which of them is meant is not decided"
DIFFERENT = {
    "two children of one id and priority": NAMES,
    "two parallel children of one id": NAMES,
    "two parents of one id": NAMES,
    "RETRY-SUBGOAL with two sub-goals": "the mistake is noticed before one is pursued",
    **{
        f"RETRY-SUBGOAL ({params})": LIMITS
        for params in ("max-tries 0", "max-tries -1", "max-tries x", "2 max-tries")
    },
    **{
        f"TIMEOUT-SUBGOAL ({params})": LIMITS
        for params in ("timeout 0", "timeout -1", "timeout x", "2 timeout")
    },
}
"""Malformed goals with a different treatment by the cores, on purpose: docs/core-goals.md."""

OLD_PLAN = ("RUN-SUBGOALS-IN-PARALLEL", "B", "again")
"""The agent resets a goal with its plan; the built-in core retracts the plan first."""

MEDDLING = [
    (sub_type, goal, change)
    for sub_type in SUB_TYPES
    for goal in "RAB"
    if goal != "B" or sub_type not in SINGLE
    for change in CHANGES
]


def difference(folder: Path, text: str, timeout: float = 20) -> str:
    """Run an agent with both cores and return where they part."""
    assert FAWKES_DIR is not None
    return first_difference(*run_both(folder, text, FAWKES_DIR, timeout=timeout))


@pytest.mark.parametrize("seed", [*range(many(300, 4)), *(seed for seed in ONCE_DIFFERENT if not FULL)])
def test_cores_agree_on_generated_trees(seed: int, tmp_path: Path) -> None:
    text = make_agent(seed)
    assert not (found := difference(tmp_path / "run", text)), f"{text}\n{found}"


@pytest.mark.parametrize("name", MALFORMED if FULL else [*MALFORMED][::8])
def test_cores_agree_on_malformed_goals(name: str, tmp_path: Path) -> None:
    found = difference(tmp_path / "run", agent(MALFORMED[name]))
    assert bool(found) == (name in DIFFERENT), found


@pytest.mark.parametrize(("sub_type", "goal", "change"), MEDDLING if FULL else MEDDLING[::40])
def test_cores_agree_on_goals_changed_by_agent(sub_type: str, goal: str, change: str, tmp_path: Path) -> None:
    """The agent retracts goals, ends them, removes their parent ... in each mode."""
    found = difference(tmp_path / "run", make_meddling_agent(sub_type, goal, change), 8)
    assert bool(found) == ((sub_type, goal, change) == OLD_PLAN), found
