"""An agent that retries a failed goal, so that its runs differ in many ways."""

from __future__ import annotations

from pathlib import Path

from tests.run.mini import write_scenario

_AGENT = """
(defrule begin
  (executive-initialized)
  (not (begun))
  =>
  (assert (begun) (skiller-control (skiller "Skiller")) (domain-operator (name act) (param-names text))
          (tries 0) (again)))
(defrule try
  ?a <- (again)
  ?t <- (tries ?n&:(< ?n {tries}))
  (skiller-control (acquired TRUE))
  (not (goal))
  =>
  (retract ?a ?t)
  (assert (tries (+ ?n 1)) (goal (id (sym-cat TRY- (gensym*))) (class TRY) (mode SELECTED))))
(defrule expand
  ?g <- (goal (id ?id) (mode SELECTED))
  =>
  (assert (plan (id P) (goal-id ?id) (type SEQUENTIAL)))
  (loop-for-count (?number 1 {skills})
    (assert (plan-action (id ?number) (plan-id P) (goal-id ?id) (action-name act)
                         (param-names text) (param-values (str-cat ?number)))))
  (modify ?g (mode EXPANDED)))
(defrule commit ?g <- (goal (mode EXPANDED)) => (modify ?g (mode COMMITTED) (committed-to P)))
(defrule dispatch ?g <- (goal (mode COMMITTED)) => (modify ?g (mode DISPATCHED)))
(defrule finish-well
  ?g <- (goal (id ?id) (mode DISPATCHED))
  (not (plan-action (goal-id ?id) (state ~FINAL)))
  => (modify ?g (mode FINISHED) (outcome COMPLETED)))
(defrule finish-badly
  ?g <- (goal (id ?id) (mode DISPATCHED))
  (plan-action (goal-id ?id) (state FAILED))
  => (modify ?g (mode FINISHED) (outcome FAILED)))
(defrule evaluate ?g <- (goal (mode FINISHED)) => (modify ?g (mode EVALUATED)))
(defrule retract-it ?g <- (goal (mode EVALUATED)) => (modify ?g (mode RETRACTED)))
(defrule clean
  ?g <- (goal (id ?id) (mode RETRACTED) (outcome FAILED))
  =>
  (do-for-all-facts ((?f plan plan-action)) (eq ?f:goal-id ?id) (retract ?f))
  (retract ?g)
  (assert (again)))
"""


def write_retrying(folder: Path, skills: int = 4, tries: int = 3) -> Path:
    """Write a scenario whose goal has ``skills`` skills and ``tries`` tries; return the folder."""
    return write_scenario(folder, agent=_AGENT.format(skills=skills, tries=tries))
