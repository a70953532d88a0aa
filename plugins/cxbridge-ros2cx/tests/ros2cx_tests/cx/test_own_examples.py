"""The examples of the plug-in: hello, messages, an action and a plan."""

from __future__ import annotations

from pathlib import Path

import pytest

import cxbridge_ros2cx
from cxbridge.executive.pddl.ast import Atom
from cxbridge.executive.pddl.printer import format_domain
from cxbridge.run import run_scenario
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge_ros2cx.cx.pddl.problem import ManagedGoal, ManagedProblem
from tests.support import CX_DIR, needs_cx

EXAMPLES = Path(cxbridge_ros2cx.__file__).parent / "examples"

EXPECTED_LINES = {
    ("hello", "hello"): ["hello", "good-bye after 4 ticks"],
    ("chat", "asker"): ["How are you? Fine.", "the light is on"],
    ("count", "client"): [
        "count to 3",
        "SUCCEEDED (1 2 3)",
        "count to 100",
        "CANCELED (1 2 3 4 5 6)",
    ],
    ("plan", "planner"): ["read: TRUE", 'go "hall" "kitchen"', 'go "kitchen" "cellar"'],
}


def test_table_has_each_example():
    assert {file.stem for file in EXAMPLES.glob("params/*.yaml")} == {name for name, _ in EXPECTED_LINES}


@pytest.mark.parametrize(
    ("name", "env"),
    [pytest.param(*each, marks=[needs_cx] if each[0] == "plan" else []) for each in EXPECTED_LINES],
)
def test_example_prints_expected_lines(name, env, tmp_path):
    """The example `plan` needs a checkout for the types of pddl_manager."""
    folder = CX_DIR if name == "plan" else None
    file = EXAMPLES / "params" / f"{name}.yaml"
    result = run_scenario(options_from_keywords(file, ros2cx=folder, timeout=2.0, log_dir=tmp_path))
    lines = [line.split("[info] ")[1] for line in (tmp_path / f"{env}.log").read_text().splitlines()]
    assert [line for line in lines if "> f-" not in line] == EXPECTED_LINES[name, env]
    assert result.status == 0


DOMAIN = """
(define (domain two-ways) (:predicates (here) (there))
  (:action walk :parameters () :precondition (here) :effect (there))
  (:action fly :parameters () :precondition (here) :effect (and (there) (not (here)))))
"""


def test_filtered_domain_has_only_kept_actions():
    problem = ManagedProblem(DOMAIN)
    problem.add_fluent("here", ())
    problem.goals["there"] = ManagedGoal([Atom("there", ())], kept_actions=("fly",))
    domain, _ = problem.filter_problem("there", "task")
    assert [each.name for each in domain.actions] == ["fly"]
    assert "walk" not in domain.text
    assert "walk" not in format_domain(domain)
