"""Endless rules are named; long finite runs are no endless rules."""

from __future__ import annotations

import pytest

from cxbridge.events import Level
from cxbridge.executive.host import endless
from cxbridge.executive.host.endless import find_ring
from tests.support import share

FIRINGS = 6_000
MANY = 300
"""Rules of the largest ring: a window has more firings than two rounds of the ring."""


def step(name: str, fact: str, then: str, more: str = "") -> str:
    """Return a rule that replaces a fact by a new fact."""
    return f"(defrule {name} {more} ?f <- {fact} => (retract ?f) (assert {then}))"


def ring(size: int) -> list[str]:
    """Return rules of which each activates the next rule, and the last rule activates the first."""
    return [step(f"r{n:03}", f"(x r{n})", f"(x r{(n + 1) % size})") for n in range(size)]


RINGS: dict[str, tuple[list[str], list[str], list[str]]] = {
    **{
        f"of {size}": (ring(size), ["(x r0)"], [f"r{n:03}" for n in range(size)])
        for size in (1, 2, 3, 5, MANY)
    },
    "that counts": (
        [step("a", "(x ?n)", "(y (+ ?n 1))"), step("b", "(y ?n)", "(x ?n)")],
        ["(x 0)"],
        ["a", "b"],
    ),
    "that counts in one rule": ([step("a", "(x ?n)", "(x (+ ?n 1))")], ["(x 0)"], ["a"]),
    "that piles up facts": (["(defrule a (x ?n) => (assert (x (+ ?n 1))))"], ["(x 0)"], ["a"]),
    "that piles up symbols": (
        ["(defrule a ?f <- (x ?n) => (retract ?f) (assert (old ?n) (x (gensym*))))"],
        ["(x g)"],
        ["a"],
    ),
    "that modifies": (
        ["(deftemplate t (slot n))", "(defrule a ?f <- (t (n ?n)) => (modify ?f (n (+ ?n 1))))"],
        ["(t (n 0))"],
        ["a"],
    ),
    "that prints": (
        ['(defrule a ?f <- (x) => (printout t "x" crlf) (retract ?f) (assert (x)))'],
        ["(x)"],
        ["a"],
    ),
    "with an error in each": (
        ["(defrule a ?f <- (x) => (retract ?f) (assert (x)) (nth$ a 1))"],
        ["(x)"],
        ["a"],
    ),
    "with facts that stay": (
        ["(defrule a (time ?) (here ?p) ?f <- (x ?n) => (retract ?f) (assert (x (+ ?n 1))))"],
        ["(time 1)", *(f"(here {n})" for n in range(5)), "(x 0)"],
        ["a"],
    ),
    "of a fact that is not there": (
        ["(defrule a (not (x)) => (assert (x)))", "(defrule b ?f <- (x) => (retract ?f))"],
        ["(start)"],
        ["a", "b"],
    ),
    "of facts and rules in another order": (
        [
            step("a", "(x 0)", "(x 1)"),
            step("c", "(x 1)", "(x 2)"),
            step("b", "(x 2)", "(y 0)"),
            step("d", "(y 0)", "(x 3)"),
            step("e", "(x 3)", "(z)"),
            step("f", "(z)", "(x 0)"),
        ],
        ["(x 0)"],
        ["a", "c", "b", "d", "e", "f"],
    ),
    "of several at once": (ring(3), ["(x r0)", "(x r1)", "(x r2)"], ["r000", "r001", "r002"]),
    "after much work": (
        ["(defrule load (declare (salience 10)) (item ?n) => (assert (cell ?n)))", *ring(2)],
        [*(f"(item {n})" for n in range(FIRINGS)), "(x r0)"],
        ["r000", "r001"],
    ),
    "before much work": (
        ["(defrule load (declare (salience -10)) (item ?n) => (assert (cell ?n)))", *ring(2)],
        [*(f"(item {n})" for n in range(FIRINGS)), "(x r0)"],
        ["r000", "r001"],
    ),
    "in the module of an agent": (
        [
            "(defmodule M (export ?ALL))",
            "(deftemplate M::go (slot n))",
            "(defrule M::a (declare (auto-focus TRUE)) ?f <- (go (n ?n)) => (modify ?f (n (+ ?n 1))))",
        ],
        ["(go (n 0))"],
        ["a"],
    ),
}

CLOSURE = [
    "(defrule begin (edge ?a ?b) => (assert (way ?a ?b)))",
    "(defrule on (way ?a ?b) (edge ?b ?c) => (assert (way ?a ?c)))",
]

WORK: dict[str, tuple[list[str], list[str], int]] = {
    "facts, the last first": (
        ["(defrule load (item ?n) => (assert (cell ?n)))"],
        [f"(item {n})" for n in range(3 * FIRINGS)],
        3 * FIRINGS,
    ),
    "facts that are used up": (
        ["(defrule load ?f <- (item ?n) => (retract ?f))"],
        [f"(item {n})" for n in range(3 * FIRINGS)],
        3 * FIRINGS,
    ),
    "facts made in one firing": (
        [
            f"(defrule fill (go) => (loop-for-count (?i 1 {3 * FIRINGS}) (assert (item ?i))))",
            "(defrule load (declare (salience -1)) (item ?n) => (assert (cell ?n)))",
        ],
        ["(go)"],
        3 * FIRINGS + 1,
    ),
    "one after the other, by a fact that counts": (
        ["(defrule load ?c <- (next ?n) (item ?n) => (retract ?c) (assert (cell ?n) (next (+ ?n 1))))"],
        ["(next 0)", *(f"(item {n})" for n in range(3 * FIRINGS))],
        3 * FIRINGS,
    ),
    "each pair of few facts": (
        ["(defrule pair (a ?x) (a ?y) => (bind ?z ?x))"],
        [f"(a {n})" for n in range(80)],
        80 * 80,
    ),
    "each pair, by a fact that counts": (
        [
            (
                "(defrule pair ?c <- (n ?n) (a ?x&:(= ?x (div ?n 80))) (b ?y&:(= ?y (mod ?n 80)))"
                " => (retract ?c) (assert (n (+ ?n 1))))"
            )
        ],
        [*(f"({t} {n})" for t in "ab" for n in range(80)), "(n 0)"],
        80 * 80,
    ),
    "a little of each fact for long": (
        [
            "(defrule take ?f <- (item ?n) => (retract ?f) (assert (left ?n 20)))",
            step("use", "(left ?i ?n&:(> ?n 0))", "(left ?i (- ?n 1))"),
        ],
        [f"(item {n})" for n in range(250)],
        250 * 21,
    ),
    "all ways in a graph": (
        CLOSURE,
        [f"(edge n{a} n{b})" for a in range(60) for b in ((a + 1) % 60, (a * 7 + 3) % 60)],
        0,
    ),
}


@pytest.fixture
def impatient(monkeypatch):
    """Look at once, and lose patience soon: the shapes count, not the time."""
    monkeypatch.setattr(endless, "_TRACE_AFTER_S", 0.0)
    monkeypatch.setattr(endless, "_WINDOW_SIZE", 2 * MANY + 100)
    monkeypatch.setattr(endless, "ENDLESS_LIMITS", ((FIRINGS, 0.0),))


def build(env, rules, facts):
    for rule in rules:
        env.build(rule)
    for fact in facts:
        assert env.assert_string(fact) is not None


@pytest.mark.parametrize("strategy", share(["depth", "breadth"], 1))
@pytest.mark.parametrize(("rules", "facts", "names"), RINGS.values(), ids=RINGS)
def test_endless_ring_is_ended_and_named(env, log, impatient, rules, facts, names, strategy):
    env.eval(f"(set-strategy {strategy})")
    build(env, rules, facts)
    fired = env.run()
    (fault,) = env.faults
    kind, _, found = fault.partition(": ")
    assert kind == "rules fire endlessly"
    shown = names[: endless._MAX_NAMES]
    more = [f"{len(names) - len(shown)} more"] if len(names) > len(shown) else []
    assert found.split(" -> ") == [*shown, *more, names[0]]
    assert fired < 40 * FIRINGS
    assert [text for text in log.texts(Level.ERROR) if text.startswith(fault)]
    assert env.run() == 0


def test_limited_run_is_not_endless(env, log, impatient):
    """The search for the rules of a ring takes long: a shutdown would search after each chunk of firings."""
    build(env, ring(3), ["(x r0)"])
    assert env.run(3 * FIRINGS) == 3 * FIRINGS
    assert env.faults == []
    assert not log.texts(Level.ERROR)


@pytest.mark.parametrize("strategy", share(["depth", "breadth"], 1))
@pytest.mark.parametrize(("rules", "facts", "firings"), WORK.values(), ids=WORK)
def test_long_finite_run_is_not_endless(env, log, impatient, rules, facts, firings, strategy):
    env.eval(f"(set-strategy {strategy})")
    build(env, rules, facts)
    assert env.run() >= firings
    assert env.faults == []
    assert not log.texts(Level.ERROR, Level.WARN)


def test_growing_facts_end_at_limit_of_firings(env, monkeypatch):
    """A limit remains for rules that make activations faster than they fire."""
    monkeypatch.setattr(endless, "MAX_FIRINGS", FIRINGS)
    env.eval("(set-strategy breadth)")
    env.build("(defrule grow ?f <- (x ?n) => (retract ?f) (assert (x (* 2 ?n)) (x (+ 1 (* 2 ?n)))))")
    env.assert_string("(x 1)")
    assert FIRINGS <= env.run() < 2 * FIRINGS
    assert len(env.faults) == 1


@pytest.mark.parametrize("last", [1, 19, 20, 21, 59, 60, 61, 139, 140, 340, 540])
@pytest.mark.parametrize("function", ["halt", "end-after-rule"])
def test_halt_and_host_end_run_at_any_firing(env, last, function):
    env.define("end-after-rule", env.end_after_rule)
    env.build(
        f"(defrule a ?f <- (x ?n) => (retract ?f) (assert (x (+ ?n 1))) (if (= ?n {last}) then ({function})))"
    )
    env.assert_string("(x 1)")
    assert env.run() == last


@pytest.mark.parametrize(
    ("firings", "ring"),
    [("a", "a"), ("aa", "a"), ("bcabca", "abc"), ("aabaab", "aab"), ("xabab", "abx"), ("abcd", "abcd")],
)
def test_find_ring_returns_repeated_firings(firings, ring):
    assert "".join(find_ring(firings)) == ring
