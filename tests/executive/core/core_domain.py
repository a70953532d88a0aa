"""Domains, plans and executors for tests of the built-in core, written down in a line each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from cxbridge.executive.host.values import Symbol
from tests.executive.core.core_bench import Bench

DOMAIN_FILES = (
    "plan.clp",
    "goal.clp",
    "domain.clp",
    "domain-index.clp",
    "domain-grounding.clp",
    "domain-effects.clp",
    "domain-exogenous.clp",
)

Formula = tuple[object, ...]
"""``("and"|"or"|"not", *formulas)``, ``("atom", predicate, *terms)`` or ``("=", *terms)``.

A term is the name of a parameter, or a constant when it begins with an upper-case letter.
"""

TYPES = {"and": "conjunction", "or": "disjunction", "not": "negation"}

EXECUTOR = """
(defrule test-executor
  ?a <- (plan-action (state PENDING) (executable TRUE))
  => (modify ?a (state EXECUTION-SUCCEEDED)))
"""


def terms_text(terms: Iterable[object]) -> str:
    """Write terms as the slots param-names and param-constants of a predicate or effect."""
    values = [str(term) for term in terms]
    names = " ".join("c" if value[0].isupper() else value for value in values)
    constants = " ".join(value if value[0].isupper() else "nil" for value in values)
    return f"(param-names {names}) (param-constants {constants})"


def formula_facts(formula: Formula, part_of: str, formula_id: str) -> list[str]:
    """Write a formula as facts, with the ids that the PDDL parser gives."""
    kind, *rest = formula
    if kind in ("atom", "="):
        predicate, terms = ("EQUALITY", rest) if kind == "=" else (rest[0], rest[1:])
        leaf = f"{formula_id}-atom"
        return [
            f"(pddl-formula (id {formula_id}) (part-of {part_of}) (type atom))",
            f"(pddl-predicate (id {leaf}) (part-of {formula_id}) (predicate {predicate}){terms_text(terms)})",
        ]
    facts = [f"(pddl-formula (id {formula_id}) (part-of {part_of}) (type {TYPES[str(kind)]}))"]
    for number, child in enumerate(rest, 1):
        assert isinstance(child, tuple)
        facts += formula_facts(child, formula_id, f"{formula_id}{number}")
    return facts


class DomainBench(Bench):
    """The domain part of the core, and the files for all states of an action."""

    def __init__(self, *files: str) -> None:
        super().__init__(*DOMAIN_FILES, *files)

    def assert_all(self, *facts: str) -> None:
        """Assert facts; each must be accepted."""
        for fact in facts:
            assert self.env.assert_string(fact) is not None, fact

    def predicate(self, name: str, *, sensed: bool = False, value: bool = False) -> None:
        """Declare a predicate."""
        self.assert_all(
            f"(domain-predicate (name {name}) (sensed {str(sensed).upper()})"
            f" (value-predicate {str(value).upper()}))"
        )

    def operator(self, name: str, parameters: str, formula: Formula | None = None, extra: str = "") -> None:
        """Declare an operator with its precondition."""
        self.assert_all(f"(domain-operator (name {name}) (param-names {parameters}) {extra})")
        if formula is not None:
            self.assert_all(*formula_facts(formula, name, f"{name}1"))

    def effect(
        self, operator: str, literal: str, when: Formula | None = None, name: str | None = None
    ) -> None:
        """Declare an effect: a predicate and its terms, after ``not`` a negative one."""
        predicate, *terms = literal.removeprefix("not ").split()
        kind = "NEGATIVE" if literal.startswith("not ") else "POSITIVE"
        named = f"(name {name})" if name else ""
        self.assert_all(
            f"(domain-effect (part-of {operator}) {named} (predicate {predicate}) (type {kind})"
            f" {terms_text(terms)})"
        )
        if when is not None:
            self.assert_all(*formula_facts(when, str(name), f"{name}1"))

    def facts(self, *atoms: str) -> None:
        """Make ground atoms true."""
        for atom in atoms:
            name, *values = atom.split()
            self.assert_all(f"(domain-fact (name {name}) (param-values {' '.join(values)}))")

    def forget(self, atom: str) -> None:
        """Make a ground atom false."""
        name, *values = atom.split()
        (index,) = [
            index
            for index, _, slots in self.env.facts("domain-fact")
            if slots["name"] == name and [str(value) for value in self.tuple(slots["param-values"])] == values
        ]
        assert self.env.retract(index)

    def holds(self) -> set[str]:
        """Return the ground atoms that are true."""
        return {
            " ".join((str(fact["name"]), *(str(value) for value in self.tuple(fact["param-values"]))))
            for fact in self.all("domain-fact")
        }

    @staticmethod
    def tuple(value: object) -> tuple[object, ...]:
        """Narrow the value of a multislot."""
        assert isinstance(value, tuple)
        return value

    def plan(self, *actions: str, kind: str = "SEQUENTIAL", goal: str = "G", slots: str = "") -> None:
        """Assert a dispatched goal and its plan; an action is an operator and its arguments."""
        plan = f"{goal}-PLAN"
        self.assert_all(
            f"(goal (id {goal}) (mode DISPATCHED) (committed-to {plan}))",
            f"(plan (id {plan}) (goal-id {goal}) (type {kind}))",
        )
        for number, action in enumerate(actions, 1):
            name, *values = action.split()
            self.assert_all(
                f"(plan-action (id {number}) (goal-id {goal}) (plan-id {plan}) (action-name {name})"
                f" (param-values {' '.join(values)}) {slots})"
            )

    def begin(self, *actions: str, kind: str = "SEQUENTIAL", goal: str = "G", slots: str = "") -> None:
        """Assert a goal and its plan as :meth:`plan` does, and run."""
        self.plan(*actions, kind=kind, goal=goal, slots=slots)
        self.env.run()

    def set_state(self, state: str, action: int = 1, goal: str = "G") -> None:
        """Play executor: put an action into a state, and run."""
        self.modify("plan-action", f"(state {state})", id=str(action), goal_id=goal)
        self.env.run()

    def action(self, number: int = 1, goal: str = "G") -> dict[str, object]:
        """Return the slots of an action."""
        return dict(self.one("plan-action", id=str(number), goal_id=goal))

    def executable(self, number: int = 1) -> bool:
        """Whether the core calls an action executable."""
        return self.action(number)["executable"] == Symbol("TRUE")

    def census(self) -> Counter[str]:
        """Count the facts of each template."""
        return Counter(name for _, name, _ in self.env.facts())


AT_FROM: Formula = ("and", ("atom", "at", "r", "from"))


def moving_bench(*files: str) -> DomainBench:
    """Return the core, and more files of it, with a domain in which robots move."""
    bench = DomainBench(*files)
    bench.predicate("at")
    bench.operator("move", "r from to", AT_FROM)
    bench.effect("move", "not at r from")
    bench.effect("move", "at r to")
    return bench
