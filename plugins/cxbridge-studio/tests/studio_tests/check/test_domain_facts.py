"""Asserted facts that the domain cannot have."""

from __future__ import annotations

import pytest

from studio_tests.check.examples import load_examples, run_check

FINE = load_examples()[0].files
KNOW = "(defrule know (executive-init) => (assert (domain-object (name ann)) {0}))"
WRONG = {
    "(domain-fact (name mett) (param-values ann))": "no domain has a predicate 'mett'",
    "(domain-fact (name met) (param-values ann ann))": "'met' has 1 parameters, but this fact has 2",
    "(domain-fact (name met))": "'met' has 1 parameters, but this fact has 0",
    "(wm-fact (key domain fact meet args? who ann))": "no domain has a predicate 'meet'",
}
RIGHT = (
    "(domain-fact (name met) (param-values ann))",
    "(domain-fact (name met) (param-values (sym-cat a nn)))",
    "(wm-fact (key domain fact met args? who ann))",
    "(wm-fact (key domain fact battery args? who robot))",  # the domain need not know all facts of the world
    "(domain-object (name (sym-cat b ob))) (domain-fact (name met) (param-values bob))",
    "(wm-fact (key domain fact met args? who (sym-cat a nn)))",
    "(wm-fact (key domain fact met args? who [ ann bob ]))",
    # a query compares the name of the predicate
    "(domain-fact (name side) (param-values ann))) (any-factp ((?f domain-fact)) (eq ?f:name side)",
)


def list_findings(facts: str, folder) -> list[str]:
    text = f"{FINE['agent.clp']}{KNOW.format(facts)}\n"
    return [line for line in run_check(FINE | {"agent.clp": text}, folder).splitlines() if "CX316" in line]


@pytest.mark.parametrize(("facts", "message"), WRONG.items())
def test_impossible_fact_is_found(facts, message, tmp_path):
    (line,) = list_findings(facts, tmp_path)
    assert line.endswith(message)


@pytest.mark.parametrize("facts", RIGHT)
def test_possible_or_computed_fact_has_no_finding(facts, tmp_path):
    assert list_findings(facts, tmp_path) == []
