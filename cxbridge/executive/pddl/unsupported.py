"""Parts of PDDL that cxbridge does not support, with their names in manuals, for error messages."""

from __future__ import annotations

from typing import Final

_CONSTRAINTS: Final = "constraints on plans"
# the names in manuals, by the keyword of a section or of a part of an action
_SECTIONS: Final = {
    ":derived": "derived predicates",
    ":axiom": "derived predicates",
    ":constraints": _CONSTRAINTS,
    ":process": "processes (PDDL+)",
    ":event": "events (PDDL+)",
    ":observe": "observations",
    ":observation": "observations",
    ":vars": "variables of actions (:vars, PDDL 1.2)",
    ":extends": "domains that extend others (PDDL 1.2)",
    ":timeless": "timeless facts (PDDL 1.2)",
    ":safety": "safety conditions (PDDL 1.2)",
    ":situation": "situations (PDDL 1.2)",
    ":method": "methods of task networks (HDDL)",
    ":task": "tasks of task networks (HDDL)",
    ":htn": "task networks (HDDL)",
    ":ordered-subtasks": "task networks (HDDL)",
    ":multi-agent": "several agents (MA-PDDL)",
    ":agent": "several agents (MA-PDDL)",
    ":private": "several agents (MA-PDDL)",
}
# the names in manuals, by the first word of a formula
_HEADS: Final = {
    "#t": "continuous effects (#t)",
    "preference": "preferences",
    "is-violated": "preferences",
    "probabilistic": "probabilistic effects (PPDDL)",
    "oneof": "non-deterministic effects (oneof)",
    "unknown": "incomplete initial states (unknown)",
    "always": _CONSTRAINTS,
    "sometime": _CONSTRAINTS,
    "within": _CONSTRAINTS,
    "at-most-once": _CONSTRAINTS,
    "sometime-after": _CONSTRAINTS,
    "sometime-before": _CONSTRAINTS,
    "always-within": _CONSTRAINTS,
    "hold-during": _CONSTRAINTS,
    "hold-after": _CONSTRAINTS,
}
TIMED_INITIAL_LITERALS: Final = "timed initial literals"
OBJECT_FLUENTS: Final = "object fluents"


def unsupported_section(keyword: str) -> str:
    """Return the name of an unsupported section or part of an action; empty for other keywords."""
    return _SECTIONS.get(keyword.lower(), "")


def unsupported_formula(word: str) -> str:
    """Return the name of an unsupported formula by its first word; empty for other words."""
    return _HEADS.get(word.lower(), "")


def unsupported_texts(name: str) -> tuple[str, str]:
    """Return message and hint about an unsupported part."""
    return f"{name} are not supported", "docs/planning.md#pddl lists the supported parts of PDDL"
