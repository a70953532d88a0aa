"""Isolated environments have only the functions in the table of allowed functions."""

from __future__ import annotations

import pytest
from clips._clips import ffi, lib

from cxbridge.clock import VirtualClock
from cxbridge.errors import ClipsError
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol
from cxbridge_studio.explain.rules.isolated import ALLOWED_FUNCTIONS, IsolatedEnvironment

FUNCTIONS_WITH_EFFECTS = """
system open close read readline read-number get-char unget-char put-char remove rename rewind seek
tell flush with-open-file chdir fetch toss print-region get-region load load* batch batch* bload
bsave save load-facts save-facts bload-facts bsave-facts load-instances save-instances
bload-instances bsave-instances restore-instances constructs-to-c dribble-on dribble-off exit quit
eval build funcall assert-string str-assert check-syntax assert retract modify duplicate
make-instance send call new apropos clear reset run halt watch unwatch seed set-locale
operating-system profile timer cx-modify cx-is-file facts rules agenda undefrule
"""
"""Functions that a look must not call."""


def list_built_in_functions() -> set[str]:
    """Return the functions of a new CLIPS environment, from the list of CLIPS."""
    env = lib.CreateEnvironment()
    try:
        value = ffi.new("CLIPSValue *")
        assert lib.Eval(env, b"(get-function-list)", value) == lib.EE_NO_ERROR
        items = value.multifieldValue
        return {ffi.string((items.contents + at).lexemeValue.contents).decode() for at in range(items.length)}
    finally:
        lib.DestroyEnvironment(env)


@pytest.fixture
def isolated_env():
    env = IsolatedEnvironment("look", EventBus(VirtualClock()))
    yield env
    env.destroy()


def test_each_function_is_allowed_or_removed(isolated_env):
    plain_env = ClipsEnvironment("plain", EventBus(VirtualClock()))
    try:
        plain_functions = {str(name) for name in plain_env.call("get-function-list")}
    finally:
        plain_env.destroy()
    all_functions = list_built_in_functions() | plain_functions
    assert len(all_functions) > 400
    assert set(ALLOWED_FUNCTIONS) <= all_functions, "an allowed function does not exist"
    assert isolated_env.removed_functions == all_functions - set(ALLOWED_FUNCTIONS) - (
        list_built_in_functions() - plain_functions
    )
    for name in sorted(all_functions - set(ALLOWED_FUNCTIONS)):
        if not name.startswith("("):
            message = get_error(isolated_env, f"({name})")
            assert "Missing function declaration" in message, (name, message)


def get_error(env: ClipsEnvironment, expression: str) -> str:
    """Return the error message of CLIPS for an expression."""
    with pytest.raises(ClipsError) as caught:
        env.eval(expression)
    return caught.value.message


@pytest.mark.parametrize("name", FUNCTIONS_WITH_EFFECTS.split())
def test_function_with_effects_is_not_allowed(name):
    assert name not in ALLOWED_FUNCTIONS


def test_constructs_work_with_remaining_functions(isolated_env):
    """The parser of CLIPS looks up functions by name: no construct may need a removed function."""
    isolated_env.build("(deftemplate robot (slot name (default ?DERIVE)) (multislot seen))")
    isolated_env.build("(defglobal ?*limit* = 3)")
    isolated_env.build(
        "(deffunction about (?x $?rest) (bind ?n 0) (progn$ (?r ?rest) (bind ?n (+ ?n ?r-index)))"
        " (foreach ?r ?rest (bind ?n (+ ?n ?r))) (loop-for-count (?i 1 3) do (bind ?n (+ ?n ?i)))"
        " (while (< ?n 100) do (bind ?n (+ ?n 50))) (if (> ?n 1) then (printout t ?n crlf))"
        ' (switch ?x (case a then (return ?n)) (default (return (str-cat ?n "-" ?x)))))'
    )
    isolated_env.assert_string('(robot (name r) (seen 1 2 "three"))')
    values = {
        "(about a 1 2 3)": 118,
        "(about b 1)": "108-b",
        "(length$ (find-all-facts ((?f robot)) (and (eq ?f:name r) (= (length$ ?f:seen) ?*limit*))))": 1,
        "(any-factp ((?f robot)) (eq ?f:name x))": Symbol("FALSE"),
        "(do-for-all-facts ((?f robot)) TRUE (fact-slot-value ?f name))": Symbol("r"),
        "(create$ (expand$ (create$ a b)) (sort > 1 3 2))": (Symbol("a"), Symbol("b"), 1, 2, 3),
        '(length "four")': 4,
    }
    assert {expression: isolated_env.eval(expression) for expression in values} == values
    isolated_env.build(
        "(defrule r (robot (name ?n&:(neq ?n x)) (seen $? 2 $?)) (test (> ?*limit* 2)) (not (y)) =>)"
    )
    assert isolated_env.has_activations(1)


def test_endless_recursion_is_an_error(isolated_env):
    isolated_env.build("(deffunction f (?x) (+ 1 (f ?x)))")
    with pytest.raises(ClipsError):
        isolated_env.eval("(f 1)")
    with pytest.raises(ClipsError, match="CLIPS cannot read this text"):
        isolated_env.build(f"(deffunction g () {'(+ 1 ' * 2_000}1{')' * 2_000})")
