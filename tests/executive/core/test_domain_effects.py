"""Effects in the built-in core: the states of an action that has been executed, exogenous operators."""

from __future__ import annotations

import pytest

from tests.executive.core.core_domain import AT_FROM, DomainBench, Formula, moving_bench


@pytest.fixture
def bench() -> DomainBench:
    """Return the core with a domain in which robots move."""
    return moving_bench()


# --- the states of an action ----------------------------------------------------------------------------


@pytest.mark.parametrize("missing", ["goal", "plan", "domain-operator"])
def test_effects_need_goal_plan_and_operator(bench: DomainBench, missing: str) -> None:
    bench.begin("move R A B")
    ((index, _, _),) = bench.env.facts(missing)
    bench.env.retract(index)
    bench.set_state("EXECUTION-SUCCEEDED")
    assert bench.action()["state"] == "EXECUTION-SUCCEEDED"


def test_action_waits_for_sensed_effects(bench: DomainBench) -> None:
    bench.predicate("seen-at", sensed=True)
    bench.effect("move", "seen-at r to")
    bench.effect("move", "not seen-at r from")
    bench.facts("at R A", "seen-at R A")
    bench.plan("move R A B")
    bench.set_state("EXECUTION-SUCCEEDED")
    assert bench.action()["state"] == "SENSED-EFFECTS-WAIT"
    pending = {(str(f["type"]), f["param-values"]) for f in bench.all("domain-pending-sensed-fact")}
    assert pending == {("POSITIVE", ("R", "B")), ("NEGATIVE", ("R", "A"))}
    assert bench.holds() == {"at R A", "seen-at R A"}, "sensed effects are never applied, others not yet"

    bench.facts("seen-at R B")
    bench.env.run()
    assert bench.action()["state"] == "SENSED-EFFECTS-WAIT"
    bench.forget("seen-at R A")
    bench.env.run()
    assert bench.action()["state"] == "FINAL"
    assert not bench.all("domain-pending-sensed-fact")
    assert bench.holds() == {"at R B", "seen-at R B"}


def test_action_waits_for_own_effects_only() -> None:
    bench = DomainBench()
    bench.predicate("said", sensed=True)
    bench.operator("say", "w")
    bench.effect("say", "said w")
    for goal, word in (("G", "hello"), ("H", "bye")):
        bench.plan(f"say {word}", goal=goal)
        bench.set_state("EXECUTION-SUCCEEDED", goal=goal)
    bench.facts("said hello")
    bench.env.run()
    assert bench.action(goal="G")["state"] == "FINAL"
    assert bench.action(goal="H")["state"] == "SENSED-EFFECTS-WAIT"


# --- effects --------------------------------------------------------------------------------------------


def run_action(bench: DomainBench, action: str) -> set[str]:
    """Let an action succeed and return the atoms that hold afterwards."""
    bench.begin(action)
    bench.set_state("EXECUTION-SUCCEEDED")
    assert bench.action()["state"] == "FINAL"
    return bench.holds()


def test_negative_effects_precede_rules_on_new_state(bench: DomainBench) -> None:
    bench.env.build(
        "(defrule test-both (declare (salience 5200)) (domain-fact (name at) (param-values ?r ?a))"
        " (domain-fact (name at) (param-values ?r ~?a)) => (assert (two-places ?r)))"
    )
    bench.facts("at R A")
    assert run_action(bench, "move R A B") == {"at R B"}
    assert not list(bench.env.facts("two-places"))


@pytest.mark.parametrize("precondition", [None, AT_FROM])
@pytest.mark.parametrize("loaded", [True, False])
def test_conditional_effects(precondition: Formula | None, loaded: bool) -> None:
    bench = DomainBench()
    for name in ("at", "loaded", "delivered", "tired"):
        bench.predicate(name)
    bench.operator("bring", "r from to", precondition)
    bench.effect("bring", "delivered to", when=("atom", "loaded", "r"), name="deliver")
    bench.effect("bring", "not loaded r", when=("and", ("atom", "loaded", "r")), name="unload")
    bench.effect("bring", "tired r", when=("not", ("atom", "loaded", "r")), name="tire")
    bench.facts("at R A", *(["loaded R"] if loaded else []))
    before = bench.census()["pddl-grounding"]
    after = run_action(bench, "bring R A B")
    assert after == {"at R A", "delivered B" if loaded else "tired R"}
    assert bench.census()["pddl-grounding"] == before
    assert not bench.all("domain-met-conditions")


def test_condition_is_decided_before_sensed_effects() -> None:
    bench = DomainBench()
    bench.predicate("holding", sensed=True)
    bench.predicate("placed")
    bench.operator("place", "x", ("atom", "holding", "x"))
    bench.effect("place", "not holding x")
    bench.effect("place", "placed x", when=("atom", "holding", "x"), name="put")
    bench.facts("holding CUP")
    bench.begin("place CUP")
    bench.set_state("EXECUTION-SUCCEEDED")
    assert bench.action()["state"] == "SENSED-EFFECTS-WAIT"
    bench.forget("holding CUP")
    bench.env.run()
    assert bench.holds() == {"placed CUP"}


def test_repeated_action_decides_conditions_again() -> None:
    bench = DomainBench()
    bench.predicate("loaded")
    bench.predicate("delivered")
    bench.predicate("told", sensed=True)
    bench.operator("bring", "r", ("not", ("atom", "broken", "r")))
    bench.effect("bring", "delivered r", when=("atom", "loaded", "r"), name="deliver")
    bench.effect("bring", "told r")
    bench.facts("loaded R")
    bench.begin("bring R")
    bench.set_state("EXECUTION-SUCCEEDED")
    assert bench.action()["state"] == "SENSED-EFFECTS-WAIT"
    bench.set_state("RUNNING")
    bench.forget("loaded R")
    bench.set_state("EXECUTION-SUCCEEDED")
    bench.facts("told R")
    bench.env.run()
    assert bench.action()["state"] == "FINAL"
    assert bench.holds() == {"told R"}


def test_negative_effect_survives_inapplicable_conditional_effect() -> None:
    bench = DomainBench()
    for name in ("lit", "magic"):
        bench.predicate(name)
    bench.operator("blow", "x")
    bench.effect("blow", "not lit x")
    bench.effect("blow", "lit x", when=("atom", "magic", "x"), name="relight")
    bench.facts("lit CANDLE")
    assert run_action(bench, "blow CANDLE") == set()


# --- exogenous operators --------------------------------------------------------------------------------
