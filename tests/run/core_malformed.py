"""Malformed goals, and changes by an agent to goals in the core's hands."""

from __future__ import annotations

from tests.run.core_trees import BEGIN, DOMAIN, RULES

SUB_TYPES = {
    "RUN-ALL-OF-SUBGOALS": "",
    "RUN-ONE-OF-SUBGOALS": "",
    "TRY-ALL-OF-SUBGOALS": "",
    "RETRY-SUBGOAL": "(params max-tries 2)",
    "TIMEOUT-SUBGOAL": "(params timeout 5)",
    "RUN-SUBGOALS-IN-PARALLEL": "(params continue-on NONE)",
}
ALL, PARALLEL = "RUN-ALL-OF-SUBGOALS", "RUN-SUBGOALS-IN-PARALLEL"
SINGLE = ("RETRY-SUBGOAL", "TIMEOUT-SUBGOAL")
MODES = (
    "FORMULATED",
    "SELECTED",
    "EXPANDED",
    "COMMITTED",
    "DISPATCHED",
    "FINISHED",
    "EVALUATED",
    "RETRACTED",
)

CHANGES = {
    "retract": "(retract ?g)",
    "complete": "(modify ?g (mode FINISHED) (outcome COMPLETED))",
    "fail": "(modify ?g (mode FINISHED) (outcome FAILED) (error FORCED))",
    "reject": "(modify ?g (mode FINISHED) (outcome REJECTED))",
    "retracted": "(modify ?g (mode RETRACTED) (outcome FAILED))",
    "unknown": "(modify ?g (mode RETRACTED) (outcome UNKNOWN))",
    "again": "(modify ?g (mode FORMULATED) (outcome UNKNOWN))",
    "only-outcome": "(modify ?g (outcome FAILED))",
    "uncommit": "(modify ?g (committed-to nil))",
    "orphan": "(modify ?g (parent nil))",
    "lost": "(modify ?g (parent NOBODY))",
    "maintain": "(modify ?g (type MAINTAIN))",
    "hold": "(modify ?g (acquired-resources A))",
    "tree": "(goal-retract-goal-tree ?id)",
    "no-plans": "(plan-retract-all-for-goal ?id)",
}
"""Changes to a goal, made once in a mode."""

FAMILY = """(assert (goal (id R-{mode}) (class TREE) (sub-type {sub_type}) {params}))
  (assert (goal (id A-{mode}) (class {first}) (parent R-{mode}) (priority 2.0)))"""
SECOND = "(assert (goal (id B-{mode}) (class GOOD) (parent R-{mode}) (priority 1.0)))"
MEDDLE = """
(defrule meddle-{mode} (declare (salience 600)) ?g <- (goal (id ?id&{goal}-{mode}) (mode {mode}))
  (not (meddled ?id)) => (assert (meddled ?id)) {change})
"""


def make_meddling_agent(sub_type: str, goal: str, change: str, first: str = "GOOD") -> str:
    """Return an agent with a family of goals per mode; ``change`` happens to ``goal`` (R, A or B)."""
    families, rules = [], []
    for mode in MODES:
        names = {"mode": mode, "sub_type": sub_type, "params": SUB_TYPES[sub_type], "first": first}
        families.append(FAMILY.format(**names))
        if sub_type not in SINGLE:
            families.append(SECOND.format(**names))
        rules.append(MEDDLE.format(mode=mode, goal=goal, change=CHANGES[change]))
    return agent("\n  ".join(families), "".join(rules))


def agent(goals: str, more: str = "") -> str:
    """Return an agent that asserts these goals."""
    rules = (rule.format(salience="") for rule in RULES)
    return "\n".join([BEGIN.format(domain=DOMAIN, trees=goals), *rules, more])


def _goal(name: str, more: str = "(class GOOD)") -> str:
    return f"(assert (goal (id {name}) {more}))"


def _parent(sub_type: str, params: str = "", more: str = "") -> str:
    text = f"(params {params})" if params else ""
    return _goal("R", f"(class TREE) (sub-type {sub_type}) {text} {more}")


def _action(number: int, plan: str = "P", more: str = "", *, goal: str = "A", name: str = "good") -> str:
    slots = more or f"(param-names text) (param-values {plan}{number})"
    whose = f"(plan-id {plan}) (goal-id {goal}) (action-name {name})"
    return f"(assert (plan-action (id {number}) {whose} {slots}))"


def _plan(name: str, more: str = "(type SEQUENTIAL)") -> str:
    return f"(assert (plan (id {name}) (goal-id A) {more}))"


def _families() -> dict[str, str]:
    """Return odd parameters and numbers of sub-goals of a parent."""
    cases = {f"{sub_type} without sub-goals": _parent(sub_type, "x 1") for sub_type in SUB_TYPES}
    for sub_type, key in (("RETRY-SUBGOAL", "max-tries"), ("TIMEOUT-SUBGOAL", "timeout")):
        limits = (
            "",
            key,
            f"{key} 0",
            f"{key} -1",
            f"{key} 1.5",
            f"{key} x",
            f"2 {key}",
            f"{key} 2 3",
            "other 2",
        )
        for params in limits:
            cases[f"{sub_type} ({params})"] = _parent(sub_type, params) + CHILD
        cases[f"{sub_type} with two sub-goals"] = _parent(sub_type, f"{key} 2") + CHILD + OTHER
    for first in ("NO", "BAD"):
        for option in ("", "on", "FAILED on", "on REJECTED FAILED", "a on FAILED", "on failed"):
            params = option.replace("on", "continue-on", 1)
            family = (
                _parent(PARALLEL, params) + _goal("A", f"(class {first}) (parent R) (priority 1.0)") + OTHER
            )
            cases[f"in parallel ({params}), {first}"] = family
    return cases


CHILD = _goal("A", "(class GOOD) (parent R) (priority 1.0)")
OTHER = _goal("B", "(class GOOD) (parent R)")
LEAF = _goal("A")

MALFORMED = {
    "an unknown class": _goal("A", "(class WHATEVER)"),
    "an unknown sub-type": _parent("RUN-AWAY") + CHILD,
    "a parent that is not there": _goal("A", "(class GOOD) (parent NOBODY)"),
    "a parent that is a leaf": _goal("R") + CHILD,
    "a parent that is a leaf of a tree": _parent(ALL) + CHILD + _goal("C", "(class GOOD) (parent A)"),
    "its own parent": _goal("A", f"(class TREE) (sub-type {ALL}) (parent A)"),
    "a cycle": _goal("A", f"(class TREE) (sub-type {ALL}) (parent B)")
    + _goal("B", f"(class TREE) (sub-type {ALL}) (parent A)"),
    "two children of one id": _parent(ALL) + CHILD + _goal("A", "(class BAD) (parent R) (priority 2.0)"),
    "two children of one id and priority": _parent(ALL)
    + CHILD
    + _goal("A", "(class TWO) (parent R) (priority 1.0)"),
    "two parallel children of one id": _parent(PARALLEL) + CHILD + _goal("A", "(class TWO) (parent R)"),
    "two roots of one id": LEAF + _goal("A", "(class TWO)"),
    "two parents of one id": _parent(ALL) + CHILD + OTHER + _parent("TRY-ALL-OF-SUBGOALS"),
    "a child with the id of its root": _parent(ALL) + _goal("R", "(class GOOD) (parent R)"),
    "a parent of type MAINTAIN": _parent(ALL, more="(type MAINTAIN)") + CHILD,
    "only children of type MAINTAIN": _parent(ALL) + _goal("A", "(class GOOD) (parent R) (type MAINTAIN)"),
    "a parallel child of type MAINTAIN that failed": _parent(PARALLEL)
    + CHILD
    + _goal("M", "(parent R) (type MAINTAIN) (mode RETRACTED) (outcome FAILED)"),
    "two plans": LEAF + _plan("Q") + _action(1, "Q"),
    "two plans of one id": LEAF + _plan("P", "(type SEQUENTIAL) (cost 2.0)") + _action(2),
    "a sequential and a temporal plan": LEAF + _plan("P", "(type TEMPORAL)"),
    "no such plan": _goal("A", "(class KEEP) (mode DISPATCHED) (committed-to NOTHING)"),
    "committed to nothing": _goal("A", "(class KEEP) (mode DISPATCHED)"),
    "an action of no plan": LEAF + _action(1, "Q"),
    "an action of no goal": LEAF + _action(1, "Q", "(state PENDING)", goal="Z"),
    "two actions of one id": LEAF + _action(1, more='(param-names text) (param-values "A-1")', name="lit"),
    "action ids below zero": LEAF + _action(-5) + _action(99),
    "an action that nobody knows": LEAF + _action(2, more="(executable TRUE)", name="fly"),
    "fewer values than names": LEAF + _action(2, more="(param-names text more) (param-values q)"),
    "more values than names": LEAF + _action(2, more="(param-names text) (param-values q r)"),
    "no params": LEAF + _action(2, more="(param-names)"),
    "a suspended plan": _goal("A", "(class NOTHING)") + _plan("P", "(type SEQUENTIAL) (suspended TRUE)"),
    "a goal born RETRACTED": _goal("A", "(class GOOD) (mode RETRACTED)"),
    "a goal born FINISHED": _goal("A", "(class GOOD) (mode FINISHED)"),
    "retried with other meta data": _parent("RETRY-SUBGOAL", "max-tries 2", "(meta mine 7)") + CHILD,
    "retried with a number that is none": _parent("RETRY-SUBGOAL", "max-tries 2", "(meta num-tries x)")
    + CHILD,
    "retried too often": _parent("RETRY-SUBGOAL", "max-tries 2", "(meta num-tries 5)") + CHILD,
    **_families(),
}
"""Malformed goals by their oddity."""
