"""Functions that query facts answer from memory as they do without it."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from cxbridge.clipstext.syntax import read
from cxbridge.clock import make_clock
from cxbridge.errors import ClipsError
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.functions.answers import RECALL_FUNCTION
from cxbridge.executive.host.functions.pure import PureFunctions
from cxbridge.executive.host.values import Symbol

TEMPLATES = """
(deftemplate goal (slot id) (slot mode) (multislot params))
(deftemplate meta (slot goal-id) (slot order))
(deftemplate other (slot id))
(defglobal ?*LIMIT* = 2)
"""
FUNCTIONS = """
(deffunction is-open (?mode) (neq ?mode RETRACTED))
(deffunction count-of (?order)
  "Counts the open goals of an order, e.g. (count-of o1)."
  (bind ?n 0)
  (do-for-all-facts ((?g goal) (?m meta))
      (and (eq ?g:id ?m:goal-id) (eq ?m:order ?order) (is-open ?g:mode))
    (bind ?n (+ ?n 1)))
  (return ?n))
(deffunction is-busy (?order) (> (count-of ?order) ?*LIMIT*))
(deffunction modes-of ($?ids)
  (bind ?modes (create$))
  (foreach ?id ?ids
    (do-for-fact ((?g goal)) (eq ?g:id ?id) (bind ?modes (create$ ?modes ?id ?g:mode))))
  ?modes)
(deffunction first-with (?param) (find-fact ((?g goal)) (member$ ?param ?g:params)))
"""
CHANGES = """
(deffunction change-mode (?id ?mode)
  (do-for-fact ((?g goal)) (eq ?g:id ?id) (modify ?g (mode ?mode))))
(deffunction drop (?id)
  (delayed-do-for-all-facts ((?m meta)) (eq ?m:goal-id ?id) (retract ?m)))
"""
CALLS = (
    "(count-of o1)",
    "(count-of o2)",
    "(is-busy o1)",
    "(modes-of g1 g2 g3)",
    "(modes-of)",
    '(count-of "o1")',
)


@pytest.fixture
def env() -> Iterator[ClipsEnvironment]:
    env = ClipsEnvironment("test", EventBus(make_clock("virtual")))
    yield env
    env.destroy()


def load(env: ClipsEnvironment, folder: Path, text: str, name: str = "agent.clp") -> None:
    file = folder / name
    file.write_text(text)
    assert env.load(file), env.loader.diagnostics


def plain(text: str) -> str:
    """Return the functions under other names; what is built with the names is not remembered."""
    for name in ("is-open", "count-of", "is-busy", "modes-of", "first-with"):
        text = text.replace(name, f"plain-{name}")
    return text


def build_plain(env: ClipsEnvironment) -> None:
    for node in read(plain(FUNCTIONS)):
        env.build_unrecorded(node.text)


def is_remembered(env: ClipsEnvironment, name: str) -> bool:
    return RECALL_FUNCTION in text_of(env, name)


def text_of(env: ClipsEnvironment, name: str) -> str:
    lines: list[str] = []
    before = env.output.redirect(lambda _level, line: lines.append(line))
    env.eval(f"(ppdeffunction {name})")
    env.output.redirect(before)
    return "\n".join(lines)


def test_the_answers_are_those_of_the_functions_themselves_whatever_happens_to_the_facts(
    env: ClipsEnvironment, tmp_path: Path
):
    load(env, tmp_path, TEMPLATES + FUNCTIONS + CHANGES)
    build_plain(env)
    assert all(is_remembered(env, name) for name in ("count-of", "is-busy", "modes-of", "first-with"))
    assert not is_remembered(env, "is-open")
    draw = random.Random(7)
    compared: set[object] = set()
    for _ in range(400):
        kind, goal = draw.randrange(6), f"g{draw.randrange(6)}"
        if kind == 0:
            env.assert_fact("goal", {"id": Symbol(goal), "mode": Symbol("FORMULATED")})
        elif kind == 1:
            env.assert_fact("meta", {"goal-id": Symbol(goal), "order": Symbol(f"o{draw.randrange(3)}")})
        elif kind == 2:
            env.eval(f"(change-mode {goal} {draw.choice(('SELECTED', 'RETRACTED'))})")
        elif kind == 3:
            env.eval(f"(drop {goal})")
        elif kind == 4:
            env.assert_fact("other", {"id": draw.randrange(9)})
        else:
            env.eval(f"(bind ?*LIMIT* {draw.randrange(4)})")
        for call in (*CALLS, *CALLS):
            answer = env.eval(call)
            assert answer == env.eval(plain(call)), call
            compared.add((call, answer))
    assert len(compared) > 30
    env.eval("(reset)")
    assert [env.eval(call) for call in CALLS] == [env.eval(plain(call)) for call in CALLS]


def test_a_modify_of_the_built_in_core_counts_as_a_change(env: ClipsEnvironment, tmp_path: Path):
    load(env, tmp_path, TEMPLATES + FUNCTIONS)
    build_plain(env)
    env.build_unrecorded(
        "(deffunction change (?id ?mode) (do-for-fact ((?g goal)) (eq ?g:id ?id) (modify ?g (mode ?mode))))"
    )  # CLIPS 6.4's own modify, as nothing rewrites it here
    env.assert_fact("goal", {"id": Symbol("g1"), "mode": Symbol("FORMULATED")})
    for mode in ("SELECTED", "EXPANDED"):
        assert env.eval("(modes-of g1)") == env.eval("(plain-modes-of g1)")
        env.eval(f"(change g1 {mode})")
        assert env.eval("(modes-of g1)") == ("g1", mode)


def test_a_function_that_is_redefined_is_asked_anew_and_so_are_those_that_call_it(
    env: ClipsEnvironment, tmp_path: Path
):
    load(env, tmp_path, TEMPLATES + FUNCTIONS)
    env.assert_fact("goal", {"id": Symbol("g1"), "mode": Symbol("FORMULATED")})
    env.assert_fact("meta", {"goal-id": Symbol("g1"), "order": Symbol("o1")})
    assert env.eval("(count-of o1)") == 1
    load(env, tmp_path, "(deffunction is-open (?mode) FALSE)", "later.clp")
    assert env.eval("(count-of o1)") == 0
    env.build_unrecorded("(deffunction is-open (?mode) TRUE)")
    assert env.eval("(count-of o1)") == 1


def test_an_agent_that_builds_functions_while_it_runs_is_not_remembered(
    env: ClipsEnvironment, tmp_path: Path
):
    load(env, tmp_path, TEMPLATES + FUNCTIONS)
    env.assert_fact("goal", {"id": Symbol("g1"), "mode": Symbol("FORMULATED")})
    env.assert_fact("meta", {"goal-id": Symbol("g1"), "order": Symbol("o1")})
    assert env.eval("(count-of o1)") == 1
    change = '(deffunction change () (build "(deffunction is-open (?mode) FALSE)"))'
    load(env, tmp_path, change, "later.clp")
    env.eval("(change)")
    assert env.eval("(count-of o1)") == 0


def test_an_error_in_a_function_is_told_as_without_memory(env: ClipsEnvironment, tmp_path: Path):
    bad = "(deffunction bad (?x) (do-for-all-facts ((?g goal)) TRUE (nth$ 1 ?x)))"
    load(env, tmp_path, TEMPLATES + bad)
    env.build_unrecorded(bad.replace("bad", "plain-bad"))
    env.assert_fact("goal", {"id": Symbol("g1")})
    messages = []
    for name in ("plain-bad", "bad"):
        with pytest.raises(ClipsError) as caught:
            env.eval(f"({name} x)")
        messages.append(str(caught.value).replace("plain-bad", "bad"))
    halted = " [PRCCODE4] Execution halted during the actions of deffunction 'bad'."
    assert messages == [messages[0], messages[0] + halted]  # the function was called by itself
    assert env.eval("(bad (create$ 1 2))") == env.eval("(plain-bad (create$ 1 2))")


IMPURE = (
    "(printout t x)",
    "(bind ?*LIMIT* 3)",
    "(assert (other (id 1)))",
    "(random)",
    "(now)",
    "(gensym)",
    "(fact-slot-value ?x id)",
    "?x:id",
    "(any-factp ((?g ?x)) TRUE)",
    "(any-factp ((?g MAIN::goal)) TRUE)",
    "(do-for-all-facts ((?g goal)) TRUE (retract ?g))",
    "(any-factp ((?g goal)) (unknown ?g:id))",
    "(foreach ?y ?x (printout t ?y))",
    "(loop-for-count (?i 1 (random)) do TRUE)",
    "(eval ?x)",
    "(funcall ?x)",
)


@pytest.mark.parametrize("body", IMPURE)
def test_what_has_effects_or_depends_on_more_than_facts_is_not_pure(body: str):
    functions = PureFunctions()
    reads = "(any-factp ((?f goal)) (eq ?f:id ?x))"
    assert functions.learn(read(f"(deffunction f (?x) {reads})")[0]) is not None
    assert functions.learn(read(f"(deffunction g (?x) {body} {reads})")[0]) is None
    assert functions.learn(read("(deffunction h (?x) (g ?x))")[0]) is None


@pytest.mark.parametrize("kind", ["defmethod", "defgeneric"])
def test_a_generic_function_of_a_known_name_is_not_pure(kind: str):
    functions = PureFunctions()
    functions.learn(read(f"({kind} length$ ((?x SYMBOL)) (random))")[0])
    assert functions.learn(read("(deffunction f (?x) (length$ ?x))")[0]) is None
