"""Statements of docs/core-goals.md and docs/testing.md about goals set back, ties, and stopped skills."""

from __future__ import annotations

import re

import pytest

from tests.docs.generated import DOCS

SCENARIO = """
clips-executive:
  spec: truth
  assert-time-each-loop: true
  automatic-goal-retraction: true
  specs:
    truth:
      action-mapping:
        drive: drive{to=?(to)s}
      init:
        stage-1:
          - {name: pddl-parser}
        stage-3:
          - name: agent
            files: [goals/run-all.clp, action-selection/sequential.clp, skills-actions.clp, agent.clp]
"""

DOMAIN = "(define (domain d) (:predicates (there)) (:action drive :parameters (?to) :effect (there)))"

DRIVE = """
(deftemplate tried (slot times))
(defrule begin
  (executive-init)
  (not (domain-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (domain-loaded) (domain-facts-loaded) (skiller-control) (goal (id TOP) (class DELIVER))))
(defrule select
  ?goal <- (goal (id TOP) (mode FORMULATED))
  (skiller-control (acquired TRUE))
  =>
  (modify ?goal (mode SELECTED)))
(defrule expand
  ?goal <- (goal (id TOP) (mode SELECTED))
  =>
  (assert (plan (id P) (goal-id TOP) (type SEQUENTIAL))
          (plan-action (id 1) (plan-id P) (goal-id TOP) (action-name drive) (param-names to)
                       (param-values home)))
  (modify ?goal (mode EXPANDED)))
(defrule commit
  ?goal <- (goal (id TOP) (mode EXPANDED))
  =>
  (modify ?goal (mode COMMITTED) (committed-to P)))
(defrule dispatch
  ?goal <- (goal (id TOP) (mode COMMITTED))
  =>
  (modify ?goal (mode DISPATCHED)))
(defrule curfew
  (curfew)
  ?goal <- (goal (id TOP) (mode DISPATCHED))
  =>
  (modify ?goal (mode FINISHED) (outcome FAILED) (error CURFEW)))
"""

END = """
(defrule evaluate
  ?goal <- (goal (mode FINISHED))
  =>
  (modify ?goal (mode EVALUATED)))
(defrule retract-root
  ?goal <- (goal (parent nil) (mode EVALUATED))
  =>
  (modify ?goal (mode RETRACTED)))
"""


@pytest.fixture
def make(cx, tmp_path, monkeypatch):
    """Return a function that makes a run of an agent."""
    monkeypatch.chdir(tmp_path)

    def make_run(rules: str):
        folder = tmp_path / "truth"
        folder.mkdir()
        (folder / "scenario.yaml").write_text(SCENARIO)
        (folder / "domain.pddl").write_text(DOMAIN)
        (folder / "agent.clp").write_text(rules)
        return cx.run(folder)

    return make_run


def back(page: str) -> str:
    """Return the rule of the manual that sets a goal back."""
    found = re.search(r"\(defrule deliver-again.*?\n\n?```", page, re.DOTALL)
    assert found is not None
    return found[0].removesuffix("```")


def test_rule_of_manual_resets_goal(make):
    run = make(
        DRIVE
        + back((DOCS / "core-goals.md").read_text())
        + END.replace("(mode FINISHED)", "(mode FINISHED) (outcome COMPLETED)")
    )
    run.skills("drive").fails("stuck", times=1).succeeds()
    run.to_end()
    (goal,) = run.goals()
    assert goal.modes.count("FORMULATED") == goal.modes.count("FINISHED") == 2
    assert goal.outcome == "COMPLETED"
    assert len(run.skills.calls) == 2


LEAVES = """
(deftemplate order (multislot ids))
(defrule leaf
  ?goal <- (goal (id ?id) (class LEAF) (mode SELECTED))
  =>
  (printout info "leaf " ?id crlf)
  (modify ?goal (mode FINISHED) (outcome COMPLETED)))
(defrule begin
  (executive-init)
  (not (begun))
  =>
  (assert (begun) (goal (id TOP) (class TOP) (sub-type RUN-ALL-OF-SUBGOALS)))
  (progn$ (?id (create$ A B C)) (assert (goal (id ?id) (class LEAF) (parent TOP)))))
(defrule select
  ?goal <- (goal (id TOP) (mode FORMULATED))
  =>
  (modify ?goal (mode SELECTED)))
(defrule expand
  ?goal <- (goal (id TOP) (mode SELECTED))
  %s
  =>
  (modify ?goal (mode EXPANDED)))
"""

TOUCH = """
(defrule touch
  ?goal <- (goal (id A) (mode FORMULATED) (params))
  =>
  (modify ?goal (params touched yes)))
"""


@pytest.mark.parametrize(
    ("rules", "order"),
    [
        (LEAVES % "", ["C", "B", "A"]),
        (LEAVES % "(goal (id A) (params touched yes))" + TOUCH, ["A", "C", "B"]),
    ],
    ids=["youngest first", "a change makes a goal the youngest"],
)
def test_youngest_goal_of_equal_priority_runs_first(make, rules, order):
    run = make(rules + END)
    run.to_end()
    assert [line.text[5:] for line in run.log if line.text.startswith("leaf ")] == order


def test_stopped_skill_of_manual(make):
    sample = re.search(
        r"```python\n(run.skills\(\"drive\"\).hangs\(\)\n.*?)```",
        (DOCS / "testing.md").read_text(),
        re.DOTALL,
    )
    assert sample is not None
    ended: list[float] = []
    run = make(DRIVE + END)
    run.skills("drive").succeeds(after=100, then=lambda: ended.append(run.seconds))
    exec(sample[1], {"run": run})
    run.to_end()
    assert ended == []
    assert [call.name for call in run.skills.calls] == ["drive"]
