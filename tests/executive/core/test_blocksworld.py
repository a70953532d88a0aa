"""Blocks on the built-in core, and a saying that depends: what the reference's tests of the domain expect.

``test_originals.py`` plays those tests themselves where there is a checkout.
"""

from __future__ import annotations

import pytest

from cxbridge.executive.host.values import TRUE
from tests.executive.core.core_domain import DomainBench

NOT_ON_TABLE = ("not", ("atom", "on-table", "x"))
LIFT = ("and", NOT_ON_TABLE, ("atom", "clear", "x"), ("atom", "hand-empty"))
UNSTACK = ("and", ("atom", "on", "x", "y"), ("atom", "clear", "x"), ("atom", "hand-empty"))
STACK = ("and", ("atom", "holding", "x"), ("atom", "clear", "y"))


@pytest.fixture
def blocks() -> DomainBench:
    """Return the core with a block B1 upon B2, and a plan to lift or to unstack it."""
    bench = DomainBench()
    bench.assert_all(
        "(domain-object-type (name block))",
        "(domain-object (name B1) (type block))",
        "(domain-object (name B2) (type block))",
    )
    for name in ("on-table", "clear", "hand-empty", "holding", "on"):
        bench.predicate(name)
    bench.operator("lift", "x", LIFT)
    for effect in ("not on-table x", "not clear x", "not hand-empty", "holding x"):
        bench.effect("lift", effect)
    bench.operator("unstack", "x y", UNSTACK)
    for effect in ("holding x", "clear y", "not clear x", "not on x y", "not hand-empty"):
        bench.effect("unstack", effect)
    bench.operator("stack", "x y", STACK)
    for effect in ("not holding x", "not clear y", "clear x", "hand-empty", "on x y"):
        bench.effect("stack", effect)
    bench.facts("hand-empty", "clear B1", "on B1 B2")
    bench.begin("lift B1", "unstack B1 B2")
    return bench


def satisfied(bench: DomainBench, formula: str) -> bool:
    """Whether a formula is satisfied in each of its groundings; it must have one."""
    values = [fact["is-satisfied"] for fact in bench.all("grounded-pddl-formula", formula_id=formula)]
    assert values
    return all(value == TRUE for value in values)


def test_a_valid_domain_has_no_error(blocks: DomainBench) -> None:
    assert blocks.all("domain-error") == []


def test_preconditions_that_hold_make_actions_executable(blocks: DomainBench) -> None:
    assert satisfied(blocks, "lift11")
    assert satisfied(blocks, "unstack1")
    assert (blocks.executable(1), blocks.executable(2)) == (True, True)


def test_a_negation_that_does_not_hold(blocks: DomainBench) -> None:
    blocks.facts("on-table B1")
    blocks.env.run()
    assert not satisfied(blocks, "lift11")
    assert not satisfied(blocks, "lift1")
    assert (blocks.executable(1), blocks.executable(2)) == (False, True)


def test_effects_change_the_facts(blocks: DomainBench) -> None:
    blocks.set_state("EXECUTION-SUCCEEDED", 1)
    assert blocks.holds() == {"holding B1", "on B1 B2"}


def test_effects_of_opposite_sign_with_other_arguments(blocks: DomainBench) -> None:
    blocks.set_state("EXECUTION-SUCCEEDED", 2)
    assert blocks.holds() == {"holding B1", "clear B2"}


def test_ids_of_actions_are_those_of_their_plan(blocks: DomainBench) -> None:
    for goal, plan in (("G", "OTHER"), ("H", "G-PLAN")):
        blocks.assert_all(
            f"(plan-action (id 1) (goal-id {goal}) (plan-id {plan}) (action-name stack) (param-values B1 B2))"
        )
    blocks.env.run()
    executable = {
        (str(action["goal-id"]), str(action["plan-id"])): action["executable"] == TRUE
        for action in blocks.all("plan-action", id="1")
    }
    assert executable == {("G", "G-PLAN"): True, ("G", "OTHER"): False, ("H", "G-PLAN"): False}


def test_a_value_that_is_only_set_is_an_error(blocks: DomainBench) -> None:
    blocks.modify("domain-predicate", "(value-predicate TRUE)", name="holding")
    blocks.env.run()
    kinds = {str(error["error-type"]) for error in blocks.all("domain-error")}
    assert kinds == {"value-predicate-without-paired-effect"}


@pytest.mark.parametrize("ready", [True, False])
def test_what_is_said_only_when_the_speaker_is_ready(ready: bool) -> None:
    bench = DomainBench()
    for name in ("said", "speaker-ready"):
        bench.predicate(name)
    bench.operator("say", "s t")
    bench.effect("say", "said t", when=("atom", "speaker-ready", "s"), name="say-it")
    if ready:
        bench.facts("speaker-ready FRONT")
    bench.begin("say FRONT HELLO")
    bench.set_state("EXECUTION-SUCCEEDED")
    assert bench.action()["state"] == "FINAL"
    assert ("said HELLO" in bench.holds()) is ready
