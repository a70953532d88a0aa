"""The core makes facts of received data without evaluation."""

from __future__ import annotations

import re

import pytest

from cxbridge.errors import ClipsError
from cxbridge.executive.host.environment import CORE_DIR
from cxbridge.executive.host.values import FactAddress

EVALUATING = re.compile(r"\((eval|build|assert-string|str-assert|funcall|system|load-facts)(?=[\s)])")
KNOWN = {
    ("host/path.clp", "build"),  # of the names of folders, in quotes, that the configuration names
    ("host/path.clp", "funcall"),  # of load, load*, batch or batch*: by name in the same file
}


def test_core_evaluates_no_text():
    found = set()
    for file in CORE_DIR.rglob("*.clp"):
        text = re.sub(r";[^\n]*", "", file.read_text())
        found |= {(str(file.relative_to(CORE_DIR)), match[1]) for match in EVALUATING.finditer(text)}
    assert found == KNOWN


@pytest.fixture(autouse=True)
def _constructs(env):
    env.build("(deftemplate goal-info (slot goal-id) (multislot names))")
    env.build("(deffunction note () (assert (noted)))")


@pytest.mark.parametrize(
    "text",
    [
        "(goal-info (goal-id a) (names x))",
        '(goal-info (goal-id "a b") (names))',
        "(wm-fact-like a 1 2.5)",
    ],
)
def test_data_makes_same_fact_as_assert_string(env, text):
    by_clips = env.call("fact-index", env.call("assert-string", text))
    env.retract(by_clips)
    made = env.call("cx-assert-data", text)
    assert isinstance(made, FactAddress)
    (_, name, slots) = next(fact for fact in env.facts() if fact[0] == env.call("fact-index", made))
    assert text.startswith(f"({name} ")
    assert slots


@pytest.mark.parametrize(
    "text",
    [
        "(goal-info (goal-id a (note)) (names x))",
        "(goal-info (goal-id =(note)))",
        "(goal-info (goal-id a)) (note)",
        "(goal-info (note))",
        "(other (note))",
        "(goal-info (goal-id ?*x*))",
    ],
)
def test_functions_in_data_are_not_called(env, text):
    with pytest.raises(ClipsError):
        env.call("cx-assert-data", text)
    assert not [name for _, name, _ in env.facts() if name == "noted"]
