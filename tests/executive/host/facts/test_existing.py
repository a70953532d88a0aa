"""`fact-existp` answers as CLIPS' own does."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from cxbridge.clock import make_clock
from cxbridge.errors import ClipsError
from cxbridge.events import EventBus
from cxbridge.executive.host.capi import EXTRA_FUNCTIONS
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.facts.existing import FactsByIndex

ARGUMENTS = (
    *("-1", "0", "1", "2", "3", "4", "5", "99", "9999999999", "(+ 1 1)"),
    *("abc", '"x"', "1.0", "(create$ 1)", "(nth$ 1 (create$ abc))", "(nth$ 1 (create$ 1.0))"),
    *("(nth$ 1 (find-fact ((?f a)) TRUE))", "(fact-index-to-fact 3)"),
)


@pytest.fixture
def env() -> Iterator[ClipsEnvironment]:
    env = ClipsEnvironment("test", EventBus(make_clock("virtual")))
    env.udfs.define_c("builtin-fact-existp", EXTRA_FUNCTIONS.FactExistpFunction, 1, 1, "*;fl")
    env.build_unrecorded("(deftemplate a (slot b))")
    yield env
    env.destroy()


def answer(env: ClipsEnvironment, function: str, argument: str) -> object:
    try:
        return env.eval(f"({function} {argument})")
    except ClipsError as error:
        return str(error).replace(function, "fact-existp")


def check_all(env: ClipsEnvironment) -> None:
    for argument in ARGUMENTS:
        found = answer(env, "fact-existp", argument)
        assert found == answer(env, "builtin-fact-existp", argument), argument


def test_it_answers_as_the_built_in_while_facts_come_and_go(env: ClipsEnvironment):
    for number in range(5):
        env.assert_fact("a", {"b": number})
        check_all(env)
    env.retract(2)
    check_all(env)
    env.build_unrecorded("(deffunction change () (do-for-fact ((?f a)) TRUE (modify ?f (b 7))))")
    env.eval("(change)")
    check_all(env)
    env.eval("(reset)")
    check_all(env)
    env.assert_fact("a", {"b": 8})
    check_all(env)


def test_it_holds_no_more_facts_than_it_should(env: ClipsEnvironment, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("cxbridge.executive.host.facts.existing._MAX_RETAINED", 3)
    facts = FactsByIndex(env.c_env)
    for number in range(9):
        env.assert_fact("a", {"b": number})
    assert [facts.exists(index) for index in range(11)] == [False, *[True] * 9, False]
    env.retract(4)
    assert not facts.exists(4)
    facts.forget()
