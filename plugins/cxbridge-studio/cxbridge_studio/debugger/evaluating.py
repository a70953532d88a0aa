"""Evaluates CLIPS expressions of users in bounded time."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Final

from msgspec import Struct

from cxbridge.clipstext.values import lone_value_text
from cxbridge.errors import ClipsError

if TYPE_CHECKING:
    from cxbridge.events import Level
    from cxbridge.executive.host.environment import ClipsEnvironment

# The maximum duration of an evaluation in seconds: during an evaluation, no rule fires and the loop waits.
LIMIT_S: Final = 1.0

MAX_LINES: Final = 1000  # the limit of the output lines, chosen freely


class Evaluation(Struct, frozen=True):
    """The result of an expression.

    :param text: the value as CLIPS text; empty without a value.
    :param output: the lines that the evaluation printed, at most :data:`MAX_LINES`.
    """

    text: str
    output: tuple[str, ...]


def evaluate(env: ClipsEnvironment, expression: str, limit_s: float = LIMIT_S) -> Evaluation:
    """Evaluate an expression between two runs of the rules, with the environment locked.

    :raises ClipsError: if the expression does not parse, fails or takes too long.
    """
    lines: list[str] = []
    is_late = threading.Event()

    def end_evaluation() -> None:
        is_late.set()
        env.api.halt()  # this thread only sets a flag, which CLIPS checks

    def keep_line(_level: Level, line: str) -> None:
        if len(lines) < MAX_LINES:
            lines.append(line)

    timer = threading.Timer(limit_s, end_evaluation)
    previous_sink = env.output.redirect(keep_line)
    timer.start()
    try:
        value = env.eval(expression)
    except ClipsError:
        if not is_late.is_set():  # CLIPS may fail because of the halt
            raise
    finally:
        timer.cancel()
        timer.join()
        env.output.redirect(previous_sink)
        env.api.clear_halt()
    if is_late.is_set():
        raise ClipsError(f"{expression} did not end within {limit_s:g} s", hint="the evaluation was ended")
    return Evaluation("" if value is None else lone_value_text(value), tuple(lines))
