"""Goals under test: an agent that runs leaves by their class, and trees of one goal and its leaves."""

from __future__ import annotations

from tests.executive.core.core_bench import GOAL_FILES, Bench

# The class of a leaf names its outcome. The agent ends roots, but does not retract them.
AGENT = """
(defrule leaf-runs ?g <- (goal (mode SELECTED) (class ?c&WILL-COMPLETED|WILL-FAILED|WILL-REJECTED)) =>
  (modify ?g (mode FINISHED) (outcome (sym-cat (sub-string 6 99 ?c)))))
(defrule leaf-fails-once ?g <- (goal (mode SELECTED) (class SECOND-TRY) (meta $?m)) =>
  (modify ?g (mode FINISHED) (outcome (if (eq ?m (create$)) then FAILED else COMPLETED)) (meta tried)))
(defrule root-begins ?g <- (goal (mode FORMULATED) (class ROOT)) => (modify ?g (mode SELECTED)))
(defrule root-expands ?g <- (goal (mode SELECTED) (class ROOT)) => (modify ?g (mode EXPANDED)))
(defrule evaluate ?g <- (goal (mode FINISHED) (parent ~nil)) => (modify ?g (mode EVALUATED)))
(defrule notice (declare (salience 10)) (goal (id ?id) (parent ~nil) (mode SELECTED)) =>
  (printout t "selected " ?id crlf))
"""

OUTCOMES = ("COMPLETED", "FAILED", "REJECTED")
PREFIXES = {
    "run-one": "RUN-ONE",
    "run-all": "RUN-ALL",
    "try-all": "TRY-ALL",
    "retry": "RETRY",
    "timeout": "TIMEOUT",
    "run-parallel": "PARALLEL",
}
SUB_TYPES = {
    "run-one": "RUN-ONE-OF-SUBGOALS",
    "run-all": "RUN-ALL-OF-SUBGOALS",
    "try-all": "TRY-ALL-OF-SUBGOALS",
    "retry": "RETRY-SUBGOAL",
    "timeout": "TIMEOUT-SUBGOAL",
    "run-parallel": "RUN-SUBGOALS-IN-PARALLEL",
}


def make_bench() -> Bench:
    """Goals of all sub-types, and an agent that only runs leaves."""
    bench = Bench(*GOAL_FILES)
    for rule in AGENT.split("\n(defrule ")[1:]:
        bench.env.build(f"(defrule {rule}")
    return bench


def grow(bench: Bench, kind: str, *leaves_wanted: str, option: str = "") -> str:
    """Make a tree of one goal and leaves with these outcomes or classes; return the id of the goal."""
    leaves = " ".join(
        f"(assert (goal (id C{number}) (class {f'WILL-{leaf}' if leaf in OUTCOMES else leaf})))"
        for number, leaf in enumerate(leaves_wanted, 1)
    )
    bench.env.eval(f"(goal-tree-assert-{kind} ROOT {option} {leaves})")
    return str(bench.one("goal", **{"class": "ROOT"})["id"])


def lone(bench: Bench, kind: str, *params: object) -> str:
    """Make a goal without sub-goals."""
    text = " ".join(str(param) for param in params)
    bench.env.eval(
        f"(assert (goal (id P) (class ROOT) (sub-type {SUB_TYPES[kind]}) (params {text}) (mode EXPANDED)))"
    )
    return "P"


def selected(bench: Bench) -> list[str]:
    """Return the ids of sub-goals in the order of their selection."""
    return [text.removeprefix("selected ") for text in bench.texts() if text.startswith("selected ")]


def error(bench: Bench, goal_id: str) -> tuple[str, str]:
    """Return error fields and message of a goal."""
    goal = bench.goal(goal_id)
    fields = goal["error"]
    assert isinstance(fields, tuple)
    return " ".join(map(str, fields)), str(goal["message"])
