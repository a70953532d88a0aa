"""The variables of matched rules, and expressions with these variables."""

from __future__ import annotations

import pytest

from cxbridge.clipstext.values import FactRef, Symbol
from cxbridge.clock import VirtualClock
from cxbridge.errors import ClipsError
from cxbridge.events import EventBus, FactChange
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge_studio.dap.bindings import find_bindings
from cxbridge_studio.dap.expressions import expand_variables
from cxbridge_studio.debugger.agenda import read_activations
from cxbridge_studio.explain.rules.environment import take_snapshot

TEMPLATES = """
(deftemplate goal (slot id) (slot mode) (multislot params))
(deffunction twice (?x) (* 2 ?x))
"""


@pytest.fixture(name="env")
def _env():
    env = ClipsEnvironment("executive", EventBus(VirtualClock()))
    for construct in TEMPLATES.strip().splitlines():
        env.build(construct)
    env.define("only-here", lambda value: value, 1)
    yield env
    env.destroy()


def find_fact(env, index):
    pointer = env.maker.find_fact(index)
    text = env.watcher.fact_text(pointer)
    return FactChange(0, "executive", True, index, text[1:].split(" ")[0].rstrip(")"), text)


def find_all_bindings(env, rule, *facts):
    env.build(f"(defrule r {rule} =>)")
    for each in facts:
        env.assert_string(each)
    bindings = []
    for _, name, basis in read_activations(env):
        assert name == "r"
        bindings.append(
            find_bindings(take_snapshot(env, "r", max_facts=0), basis, lambda index: find_fact(env, index))
        )
    return bindings


GOALS = ("(goal (id g1) (mode A) (params x 1))", "(goal (id g2) (mode B) (params))", "(level 3)")


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        ("(level ?n)", {"n": 3}),
        ("?f <- (goal (id ?id) (mode A)) (level ?n)", {"f": FactRef(1), "id": Symbol("g1"), "n": 3}),
        ("(goal (mode A) (params $?p))", {"p": (Symbol("x"), 1)}),
        ("(goal (params ?first $?rest))", {"first": Symbol("x"), "rest": (1,)}),
        ("(level ?n) (test (> ?n 2)) (goal (id ?id) (mode B))", {"n": 3, "id": Symbol("g2")}),
        ("(level ?n) (not (goal (mode C))) (goal (id g2) (mode ?m))", {"n": 3, "m": Symbol("B")}),
        ("(exists (goal (id ?x))) (level ?n)", {"n": 3}),
        ("(logical (level ?n) (goal (id ?id) (mode A)))", {"n": 3, "id": Symbol("g1")}),
        ("(level ?n) (or (goal (id ?id) (mode C)) (goal (id ?id) (mode B)))", {"n": 3, "id": Symbol("g2")}),
        ("(level ?n&:(> (twice ?n) 5))", {"n": 3}),
        ("(level ?n&:(only-here ?n))", {"n": 3}),  # a function of this environment only
        ("(goal (id ?a&g1)) (goal (id ?b&~?a))", {"a": Symbol("g1"), "b": Symbol("g2")}),
        ("(not (goal (mode C)))", {}),
    ],
)
def test_variables_of_condition_are_bound(env, rule, expected):
    assert find_all_bindings(env, rule, *GOALS) == [expected]


def test_bindings_follow_order_of_facts_in_match(env):
    bindings = find_all_bindings(env, "?a <- (goal) ?b <- (goal)", *GOALS)
    pairs = {(binding["a"].index, binding["b"].index) for binding in bindings}
    assert pairs == {(1, 1), (1, 2), (2, 1), (2, 2)}


def test_unknown_fact_of_match_is_an_error(env):
    env.build("(defrule r (level ?n) =>)")
    snapshot = take_snapshot(env, "r", max_facts=0)
    with pytest.raises(ClipsError, match="is no longer known"):
        find_bindings(snapshot, "f-1", lambda _index: None)


KNOWN = {
    "x": 3,
    "s": Symbol("abc"),
    "t": 'a "text"',
    "f": FactRef(7),
    "m": (1, Symbol("b"), "c"),
    "empty": (),
    "real": 1.0,
}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("(+ ?x 1)", "(+ 3 1)"),
        ("(eq ?s ?t)", r'(eq abc "a \"text\"")'),
        ("(length$ $?m)", '(length$ (create$ 1 b "c"))'),
        ("(length$ ?empty)", "(length$ (create$ ))"),
        ("(retract ?f)", "(retract 7)"),
        ("(eq ?f:mode A)", "(eq (fact-slot-value 7 mode) A)"),
        ("?real", "1.0"),
        ('(str-cat "?x" ?x) ; ?x', '(str-cat "?x" 3) ; ?x'),
        ("(+ ?y ?*x* 1)", "(+ ?y ?*x* 1)"),
        ("(do-for-all-facts ((?f goal)) TRUE (printout t ?f ?x))",) * 1
        + ("(do-for-all-facts ((?f goal)) TRUE (printout t ?f 3))",),
        ("(bind ?x 4)", "(bind ?x 4)"),
        ("(foreach ?x ?m (f ?x ?s))", '(foreach ?x (create$ 1 b "c") (f ?x abc))'),
    ],
)
def test_variables_in_expression_become_values(text, expected):
    assert expand_variables(text, KNOWN) == expected
