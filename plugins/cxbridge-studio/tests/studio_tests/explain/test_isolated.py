"""Environments made for looking have the functions that somebody has given a reason for, and no other."""

from __future__ import annotations

import pytest
from clips._clips import ffi, lib

from cxbridge.clock import VirtualClock
from cxbridge.errors import ClipsError
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol
from cxbridge_studio.explain.rules.isolated import ALLOWED_FUNCTIONS, IsolatedEnvironment

REACH_OUT = """
system open close read readline read-number get-char unget-char put-char remove rename rewind seek
tell flush with-open-file chdir fetch toss print-region get-region load load* batch batch* bload
bsave save load-facts save-facts bload-facts bsave-facts load-instances save-instances
bload-instances bsave-instances restore-instances constructs-to-c dribble-on dribble-off exit quit
eval build funcall assert-string str-assert check-syntax assert retract modify duplicate
make-instance send call new apropos clear reset run halt watch unwatch seed set-locale
operating-system profile timer cx-modify cx-is-file facts rules agenda undefrule
"""
"""What nothing may do that looks; beside all that is not in the list of what it may."""


def built_in() -> set[str]:
    """Every function that a CLIPS environment has when it is made, by CLIPS' own list."""
    env = lib.CreateEnvironment()
    try:
        value = ffi.new("CLIPSValue *")
        assert lib.Eval(env, b"(get-function-list)", value) == lib.EE_NO_ERROR
        items = value.multifieldValue
        return {ffi.string((items.contents + at).lexemeValue.contents).decode() for at in range(items.length)}
    finally:
        lib.DestroyEnvironment(env)


@pytest.fixture
def looking():
    env = IsolatedEnvironment("look", EventBus(VirtualClock()))
    yield env
    env.destroy()


def test_every_function_is_allowed_with_a_reason_or_gone(looking):
    usual = ClipsEnvironment("usual", EventBus(VirtualClock()))
    try:
        of_shims = {str(name) for name in usual.call("get-function-list")}
    finally:
        usual.destroy()
    there = built_in() | of_shims
    assert len(there) > 400
    assert set(ALLOWED_FUNCTIONS) <= there, "a reason for something that does not exist"
    assert looking.removed_functions == there - set(ALLOWED_FUNCTIONS) - (built_in() - of_shims)
    for name in sorted(there - set(ALLOWED_FUNCTIONS)):
        if not name.startswith("("):
            message = said(looking, f"({name})")
            assert "Missing function declaration" in message, (name, message)


def said(env: ClipsEnvironment, expression: str) -> str:
    """What CLIPS says against an expression."""
    with pytest.raises(ClipsError) as caught:
        env.eval(expression)
    return caught.value.message


@pytest.mark.parametrize("name", REACH_OUT.split())
def test_nothing_that_reaches_out_is_allowed(name):
    assert name not in ALLOWED_FUNCTIONS


def test_what_is_left_still_works(looking):
    """What is removed is looked up by CLIPS' parser for nothing that is left."""
    looking.build("(deftemplate robot (slot name (default ?DERIVE)) (multislot seen))")
    looking.build("(defglobal ?*limit* = 3)")
    looking.build(
        "(deffunction about (?x $?rest) (bind ?n 0) (progn$ (?r ?rest) (bind ?n (+ ?n ?r-index)))"
        " (foreach ?r ?rest (bind ?n (+ ?n ?r))) (loop-for-count (?i 1 3) do (bind ?n (+ ?n ?i)))"
        " (while (< ?n 100) do (bind ?n (+ ?n 50))) (if (> ?n 1) then (printout t ?n crlf))"
        ' (switch ?x (case a then (return ?n)) (default (return (str-cat ?n "-" ?x)))))'
    )
    looking.assert_string('(robot (name r) (seen 1 2 "three"))')
    values = {
        "(about a 1 2 3)": 118,
        "(about b 1)": "108-b",
        "(length$ (find-all-facts ((?f robot)) (and (eq ?f:name r) (= (length$ ?f:seen) ?*limit*))))": 1,
        "(any-factp ((?f robot)) (eq ?f:name x))": Symbol("FALSE"),
        "(do-for-all-facts ((?f robot)) TRUE (fact-slot-value ?f name))": Symbol("r"),
        "(create$ (expand$ (create$ a b)) (sort > 1 3 2))": (Symbol("a"), Symbol("b"), 1, 2, 3),
        '(length "four")': 4,
    }
    assert {expression: looking.eval(expression) for expression in values} == values
    looking.build(
        "(defrule r (robot (name ?n&:(neq ?n x)) (seen $? 2 $?)) (test (> ?*limit* 2)) (not (y)) =>)"
    )
    assert looking.has_activations(1)


def test_a_function_without_end_is_guarded(looking):
    looking.build("(deffunction f (?x) (+ 1 (f ?x)))")
    with pytest.raises(ClipsError):
        looking.eval("(f 1)")
    with pytest.raises(ClipsError, match="CLIPS cannot read this text"):
        looking.build(f"(deffunction g () {'(+ 1 ' * 2_000}1{')' * 2_000})")
