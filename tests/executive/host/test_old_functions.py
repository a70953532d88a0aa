"""The functions of CLIPS 6.30 that the host makes: known in every module, as built-ins are."""

from __future__ import annotations

import re

import pytest

from cxbridge.errors import ClipsError
from cxbridge.executive.host.shims import CLIPS630_NAMES, FUNCTIONS

ALONE = "(defmodule ALONE)"
"""A module that imports nothing."""


@pytest.fixture
def alone(env):
    """An environment whose current module imports nothing."""
    env.build(ALONE)
    yield env
    assert env.eval("(get-current-module)") == "ALONE"


def parameters(name: str) -> list[str]:
    """Return the parameters of a function."""
    match = re.match(
        r"\(deffunction \S+ \(([^)]*)\)", next(text for text in FUNCTIONS if f" {name} (" in text)
    )
    assert match is not None
    return match[1].split()


@pytest.mark.parametrize("name", CLIPS630_NAMES)
def test_functions_are_known_in_module_without_imports(alone, name):
    arguments = " ".join("(create$ 1)" for parameter in parameters(name) if not parameter.startswith("$"))
    alone.build(f"(deffunction calls () ({name} {arguments}))")


@pytest.mark.parametrize("name", CLIPS630_NAMES)
def test_wrong_number_of_arguments_is_refused_by_written_name(alone, name):
    least = sum(not parameter.startswith("$") for parameter in parameters(name))
    if least < len(parameters(name)) and least == 0:
        return  # any number will do
    with pytest.raises(ClipsError, match=rf"'{re.escape(name)}' expected"):
        alone.build(f"(deffunction calls () ({name}{' 1' * (least - 1) if least else ' 1'}))")


def test_rules_of_modules_use_functions(env, log):
    env.build("(defmodule MAIN (export deftemplate state))")
    env.build("(deftemplate MAIN::state (multislot way))")
    env.build("(defrule MAIN::make => (assert (state (way a b c))) (focus REPORT))")
    env.build("(defmodule REPORT (import MAIN deftemplate state))")
    env.build(
        '(defrule REPORT::tell (state (way $?w&:(= 3 (length$ ?w)))) => (printout t (nth$ 2 ?w) " "'
        ' (length$ ?w) " " (round 2.5) " " (sub-string 1 2 "abc") crlf))'
    )
    env.run()
    assert "b 3 2 ab" in log.texts()


def test_functions_survive_clear(env):
    env.eval("(clear)")
    env.build(ALONE)
    assert (env.eval("(nth$ 2 (create$ a b))"), env.eval('(length "abc")')) == ("b", 3)


def test_sequence_operator_spreads_arguments(env):
    env.eval("(set-sequence-operator-recognition TRUE)")
    env.build("(deffunction second ($?x) (nth$ 2 (create$ $?x)))")
    assert env.eval("(second a b c)") == "b"


def test_agent_for_6_4_may_redefine_functions(env, clp):
    assert env.load(clp("(deffunction member (?x $?rest) 99)"))
    assert env.eval("(member 1 2)") == 99


def test_funcall_finds_functions_by_name(env):
    assert env.eval("(funcall nth$ 2 (create$ a b))") == "b"
