"""Many goals in one run: nothing fails, and memory does not grow.

Goals come in tens, each with a plan of one action that a Skiller executes at once, and are retracted.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from cxbridge.run.agent import Run
from cxbridge.run.options import RunOptions

AT_ONCE = 10
WARM_UP = 0.3
"""The part of the goals before the first measurement: bounded lists have their full length then."""

CONFIG = """
clips-executive:
  assert-time-each-loop: true
  automatic-goal-retraction: true
  spec: soak
  specs:
    soak:
      init:
        stage-1: [{name: pddl-parser}]
        stage-3:
          - name: agent
            files: [soak.clp, action-selection/sequential.clp]
"""
AGENT = """
(defrule begin (executive-initialized) (not (made $?)) =>
  (assert (made 0 0) (domain-operator (name work) (param-names n))))
(defrule make ?m <- (made ?n&:(< ?n @GOALS@) ?last) (not (goal)) (time ? ?now&~?last) =>
  (retract ?m)
  (assert (made (+ ?n @AT_ONCE@) ?now))
  (loop-for-count (?i 1 @AT_ONCE@)
    (bind ?goal (sym-cat G (+ ?n ?i)))
    (assert (goal (id ?goal) (class WORK) (message (str-cat "goal " (+ ?n ?i))) (mode EXPANDED)))
    (assert (plan (id P) (goal-id ?goal) (type SEQUENTIAL)))
    (assert (plan-action (id 1) (plan-id P) (goal-id ?goal) (action-name work) (param-names n)
                         (param-values ?i) (executable TRUE)))))
(defrule commit ?g <- (goal (mode EXPANDED)) => (modify ?g (mode COMMITTED) (committed-to P)))
(defrule dispatch ?g <- (goal (mode COMMITTED)) => (modify ?g (mode DISPATCHED)))
(defrule act ?a <- (plan-action (state PENDING)) => (modify ?a (state EXECUTION-SUCCEEDED)))
(defrule evaluate ?g <- (goal (mode FINISHED)) => (modify ?g (mode EVALUATED)))
(defrule retract ?g <- (goal (mode EVALUATED)) => (modify ?g (mode RETRACTED)))
"""


def measure(goals: int, gauge: Callable[[Run], float]) -> list[tuple[int, float]]:
    """Run the goals; return the numbers of ended goals and the used memory, ten times after the warm-up.

    :param gauge: returns the memory that a run uses.
    :raises AssertionError: when a goal does not complete.
    """
    found: list[tuple[int, float]] = []
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        (here / "scenario.yaml").write_text(CONFIG)
        (here / "soak.clp").write_text(
            AGENT.replace("@GOALS@", str(goals)).replace("@AT_ONCE@", str(AT_ONCE))
        )
        with Run(RunOptions(scenario=here, skiller="none")) as run:
            run.start()
            outcomes = run.executive.goals.outcome_counts
            due = goals * WARM_UP
            while outcomes.total() < goals:
                start_us = run.clock.now_us()
                run.loop.run_once()
                over = run.is_over
                run.clock.sleep_until(start_us + run.loop.period_us)
                if outcomes.total() >= due or (over and outcomes.total() >= goals):
                    found.append((outcomes.total(), gauge(run)))
                    due += goals * (1 - WARM_UP) / 10
            assert outcomes == {"COMPLETED": goals}, outcomes
    return found
