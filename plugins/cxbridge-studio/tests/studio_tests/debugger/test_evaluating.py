"""The evaluation of expressions: values, output, errors, and a time limit."""

from __future__ import annotations

import pytest

from cxbridge.clock import RealClock
from cxbridge.errors import ClipsError
from cxbridge.events import EventBus, LogLine
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge_studio.debugger.evaluating import MAX_LINES, evaluate


@pytest.fixture(name="env")
def _env():
    env = ClipsEnvironment("test", EventBus(RealClock()))
    yield env
    env.destroy()


@pytest.mark.parametrize(
    ("expression", "text"),
    [("(+ 1 2)", "3"), ('(create$ a 1.5 "b")', '(a 1.5 "b")'), ('(str-cat "x" y)', '"xy"'), ("TRUE", "TRUE")],
)
def test_value_is_clips_text(env, expression, text):
    assert evaluate(env, expression).text == text


def test_printed_lines_are_output_and_not_logged(env):
    logged: list[str] = []
    env.bus.subscribe(lambda line: logged.append(line.text), LogLine)
    evaluation = evaluate(env, '(printout t "one" crlf "two")')
    assert (evaluation.text, evaluation.output, logged) == ("", ("one", "two"), [])
    env.eval('(printout t "three" crlf)')
    assert logged == ["three"]


def test_evaluation_works_after_invalid_expression(env):
    for expression in ("(no-such-function)", "(+ 1", "(/ 1 0)"):
        with pytest.raises(ClipsError, match="cannot evaluate"):
            evaluate(env, expression)
    assert evaluate(env, "(+ 1 1)").text == "2"


def test_endless_expression_is_ended(env):
    with pytest.raises(ClipsError, match="did not end"):
        evaluate(env, '(while TRUE (printout t "x" crlf))', limit_s=0.05)
    assert len(evaluate(env, f'(loop-for-count {MAX_LINES + 5} (printout t "x" crlf))').output) == MAX_LINES
