"""The domain of the built-in core: grounding, checking, and that nothing is left behind."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cxbridge.executive.host.values import FALSE, TRUE
from tests.executive.core.core_domain import EXECUTOR, DomainBench, Formula, moving_bench
from tests.support import many


@pytest.fixture
def bench() -> DomainBench:
    """Return the core with a domain in which robots move."""
    return moving_bench()


# --- grounding ------------------------------------------------------------------------------------------


def test_grounding_makes_documented_facts(bench: DomainBench) -> None:
    bench.begin("move R A B")
    grounding = bench.one("pddl-grounding")
    assert bench.action()["precondition"] == grounding["id"]
    assert str(grounding["id"]).startswith("grounding-move1-gen")
    assert grounding["param-names"] == ("r", "from", "to")
    assert grounding["param-values"] == ("R", "A", "B")
    formulas = bench.all("grounded-pddl-formula")
    assert {f["formula-id"] for f in formulas} == {"move1", "move11"}
    assert all(str(f["id"]).startswith(f"grounded-{f['formula-id']}-gen") for f in formulas)
    predicate = bench.one("grounded-pddl-predicate")
    assert predicate["predicate-id"] == "move11-atom"
    assert predicate["id"] == f"grounded-move11-atom-{grounding['id']}"
    assert {f["grounding"] for f in (*formulas, predicate)} == {grounding["id"]}
    assert {f["is-satisfied"] for f in (*formulas, predicate)} == {FALSE}

    bench.facts("at R A")
    bench.env.run()
    formulas = bench.all("grounded-pddl-formula")
    assert {f["is-satisfied"] for f in formulas} == {TRUE}
    assert bench.one("grounded-pddl-predicate")["is-satisfied"] == TRUE


@pytest.mark.parametrize("action", ["unheard-of A", "free A"])
def test_action_without_precondition_is_executable(action: str) -> None:
    bench = DomainBench()
    bench.operator("free", "x")
    bench.begin(action)
    assert bench.executable()
    assert bench.action()["precondition"] == "nil"


def test_changed_arguments_are_grounded_again(bench: DomainBench) -> None:
    bench.facts("at R A")
    bench.begin("move R A B")
    assert bench.executable()
    before = bench.census()
    bench.modify("plan-action", "(param-values R C B)", id="1")
    bench.env.run()
    assert not bench.executable()
    assert bench.one("pddl-grounding")["param-values"] == ("R", "C", "B")
    assert bench.census() == before


@pytest.mark.parametrize("state", ["FINAL", "FAILED"])
def test_grounding_of_finished_action_is_retracted(bench: DomainBench, state: str) -> None:
    bench.begin("move R A B")
    bench.set_state(state)
    assert bench.action()["precondition"] == "nil"
    for template in ("pddl-grounding", "grounded-pddl-formula", "grounded-pddl-predicate"):
        assert not bench.all(template), template
    bench.set_state("FORMULATED")
    assert bench.action()["precondition"] != "nil", "an action that is tried again is grounded again"


OWN_FORMULA = (
    "(deffunction ground-mine () (ground-pddl-formula mine (create$ x) (create$ A) nil))",
    """(deffunction assert-mine ()
      (assert (pddl-formula (id mine1) (part-of mine) (type negation))
              (pddl-formula (id mine11) (part-of mine1) (type atom))
              (pddl-predicate (id mine11-atom) (part-of mine11) (predicate sent)
                              (param-names x) (param-constants nil))))""",
)
"""A condition of the agent, without operator and effect."""


@pytest.mark.parametrize("functions", [("assert-mine", "ground-mine"), ("assert-mine", "run", "ground-mine")])
def test_grounding_of_agents_formula_lives_as_long_as_formula(
    bench: DomainBench, functions: tuple[str, ...]
) -> None:
    for function in OWN_FORMULA:
        bench.env.build(function)
    empty = bench.census()
    for function in functions:
        bench.env.eval(f"({function})")
    bench.env.run()
    assert bench.one("grounded-pddl-formula", formula_id="mine1")["is-satisfied"] == TRUE
    bench.facts("sent A")
    bench.env.run()
    assert bench.one("grounded-pddl-formula", formula_id="mine1")["is-satisfied"] == FALSE
    bench.env.eval("(do-for-all-facts ((?f pddl-formula)) (eq ?f:part-of mine) (retract ?f))")
    bench.env.eval("(do-for-all-facts ((?f pddl-formula pddl-predicate)) (eq ?f:part-of mine1) (retract ?f))")
    bench.env.run()
    for template in ("pddl-grounding", "grounded-pddl-formula", "pddl-formula-tree"):
        left = [fact for fact in bench.all(template) if "mine" in str(fact)]
        assert not left, template
    assert empty["pddl-grounding"] == bench.census()["pddl-grounding"]


# --- checking -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("changes", [("p A", "q A"), ("q A", "p A")])
def test_executable_flips_after_lookup_of_all_atoms(changes: tuple[str, str]) -> None:
    bench = DomainBench()
    bench.operator("stop", "x", ("and", ("atom", "p", "x"), ("not", ("atom", "q", "x"))))
    bench.operator("go", "x", ("or", ("atom", "p", "x"), ("not", ("atom", "q", "x"))))
    bench.plan("stop A", "go A")
    for action in (1, 2):
        bench.set_state("PENDING", action)
    bench.facts(*changes)
    bench.env.run()
    assert not bench.executable(1)
    assert bench.executable(2)
    assert bench.texts() == [], "both are as they were, all the time"


@pytest.mark.parametrize(
    ("fact", "value", "expected"),
    [("a", "a", True), ('"a"', "a", False), ("1", "1", True), ("1.0", "1", False), ("1", "1.0", False)],
)
def test_values_of_different_types_differ(fact: str, value: str, expected: bool) -> None:
    bench = DomainBench()
    bench.operator("use", "x", ("atom", "ready", "x"))
    bench.facts(f"ready {fact}")
    bench.begin(f"use {value}")
    assert bench.executable() is expected


TERMS = st.sampled_from(["x", "y", "A", "B"])
ATOMS = st.one_of(
    st.tuples(st.just("atom"), st.sampled_from(["p", "q"]), TERMS),
    st.tuples(st.just("atom"), st.just("r"), TERMS, TERMS),
    st.tuples(st.just("="), TERMS, TERMS),
)
FORMULAS: st.SearchStrategy[Formula] = st.recursive(
    ATOMS,
    lambda inner: st.one_of(
        st.tuples(st.just("not"), inner),
        st.lists(inner, max_size=3).map(lambda children: ("and", *children)),
        st.lists(inner, max_size=3).map(lambda children: ("or", *children)),
    ),
    max_leaves=8,
)
GROUND_ATOMS = ["p A", "p B", "q A", "q B", "r A A", "r A B", "r B A", "r B B"]


def holds(formula: Formula, arguments: dict[str, str], facts: set[str]) -> bool:
    """Evaluate a formula in Python."""
    kind, *rest = formula
    if kind == "and":
        return all(holds(child, arguments, facts) for child in rest if isinstance(child, tuple))
    if kind == "or":
        return any(holds(child, arguments, facts) for child in rest if isinstance(child, tuple))
    if kind == "not":
        assert isinstance(rest[0], tuple)
        return not holds(rest[0], arguments, facts)
    terms = [arguments.get(str(term), str(term)) for term in rest]
    return terms[0] == terms[1] if kind == "=" else " ".join(terms) in facts


@pytest.fixture(scope="module")
def shared_bench() -> DomainBench:
    """Return a shared core; tests wipe its domain."""
    return DomainBench()


@settings(
    max_examples=many(100, 25), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    formula=FORMULAS,
    x=st.sampled_from("AB"),
    y=st.sampled_from("AB"),
    facts=st.sets(st.sampled_from(GROUND_ATOMS)),
    changes=st.lists(st.sampled_from(GROUND_ATOMS), max_size=6),
)
def test_executable_equals_formula(
    shared_bench: DomainBench, formula: Formula, x: str, y: str, facts: set[str], changes: list[str]
) -> None:
    """The incremental result equals the result from scratch, also after changes."""
    shared_bench.env.eval("(domain-wipe)")
    shared_bench.env.eval("(do-for-all-facts ((?f plan goal plan-action)) TRUE (retract ?f))")
    shared_bench.operator("use", "x y", formula)
    shared_bench.facts(*sorted(facts))
    shared_bench.begin(f"use {x} {y}")
    arguments = {"x": x, "y": y}
    assert shared_bench.executable() is holds(formula, arguments, facts)
    for atom in changes:
        if atom in facts:
            shared_bench.forget(atom)
        else:
            shared_bench.facts(atom)
        facts = facts ^ {atom}
        shared_bench.env.run()
        assert shared_bench.executable() is holds(formula, arguments, facts)


# --- users' rules, leaks ------------------------------------------------------------


def test_thousand_actions_leave_no_facts(bench: DomainBench) -> None:
    """CLIPS keeps the memory of retracted facts that refer to each other."""
    bench.predicate("said", sensed=True)
    bench.effect("move", "said r")
    bench.effect("move", "not at r to", when=("atom", "at", "r", "AWAY"), name="never")
    bench.facts("at R A", "said R")
    bench.env.build(EXECUTOR)
    bench.env.run()
    before = bench.census()
    memory = []
    for number in range(100):
        bench.plan(*["move R A B", "move R B A"] * 5, kind="NONE", goal=f"G{number}")
        for action in range(1, 11):
            bench.set_state("PENDING", action, f"G{number}")
            assert bench.action(action, f"G{number}")["state"] == "FINAL"
        bench.env.eval(f"(plan-retract-all-for-goal G{number})")
        bench.env.eval("(do-for-all-facts ((?g goal)) TRUE (retract ?g))")
        bench.env.run()
        bench.env.eval("(release-mem)")
        memory.append(int(str(bench.env.eval("(mem-used)"))))
    assert bench.holds() == {"at R A", "said R"}
    assert bench.census() == before
    assert max(memory[-50:]) - max(memory[:50]) < 2000, "bytes, for 500 actions"
