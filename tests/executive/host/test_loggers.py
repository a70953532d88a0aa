"""Loggers of an environment: by priority, replacing those below or beside them."""

from __future__ import annotations

import pytest

from cxbridge.errors import ClipsError
from cxbridge.events import Level
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.loggers import MAX_LOGGERS, ClipsLogger, LoggerStack


@pytest.fixture(name="lines")
def _lines():
    return []


@pytest.fixture(name="stack")
def _stack(lines):
    return LoggerStack(lambda level, line: lines.append(("log", level.value, line)))


def logger(lines, name, **given):
    return ClipsLogger(name, lambda level, line: lines.append((name, level.value, line)), **given)


def test_one_that_accompanies_lets_lines_pass(stack, lines):
    stack.add(logger(lines, "doors", contains="door"))
    stack.log(Level.INFO, "a door")
    stack.log(Level.INFO, "a window")
    assert lines == [("doors", "I", "a door"), ("log", "I", "a door"), ("log", "I", "a window")]


def test_one_that_replaces_keeps_what_it_takes_and_no_more(stack, lines):
    stack.add(logger(lines, "loud", level=Level.WARN, replaces=True))
    stack.log(Level.ERROR, "broken")
    stack.log(Level.DEBUG, "tick")
    assert lines == [("loud", "E", "broken"), ("log", "D", "tick")]
    stack.remove("loud")
    stack.log(Level.ERROR, "again")
    assert lines[2:] == [("log", "E", "again")]


def test_they_stack_by_priority_and_among_equals_the_last_is_first(stack, lines):
    for name, priority in (("a", 40), ("b", 40), ("c", 50), ("d", 20), ("e", 30)):
        stack.add(logger(lines, name, priority=priority))
    assert [each.name for each in stack.loggers] == ["c", "b", "a", "e", "log", "d"]
    stack.log(Level.INFO, "x")
    assert [name for name, _, _ in lines] == ["c", "b", "a", "e", "log", "d"]


def test_one_below_hears_nothing_of_what_is_replaced(stack, lines):
    stack.add(logger(lines, "below", priority=-5))
    stack.add(logger(lines, "above", replaces=True))
    stack.log(Level.INFO, "x")
    assert lines == [("above", "I", "x")]


def test_a_level_is_that_of_one_logger(stack, lines):
    stack.add(logger(lines, "all"))
    stack.set_level("log", Level.ERROR)
    stack.log(Level.INFO, "x")
    assert lines == [("all", "I", "x")]
    assert stack.level_of("log") is Level.ERROR


def test_what_makes_no_sense_is_refused(stack, lines):
    for number in range(MAX_LOGGERS - 1):
        stack.add(logger(lines, f"n{number}"))
    with pytest.raises(ClipsError, match="more than 16"):
        stack.add(logger(lines, "one too many"))
    with pytest.raises(ClipsError, match="already"):
        stack.add(logger(lines, "n0"))
    stack.remove("n0")
    with pytest.raises(ClipsError, match="no logger 'n0'"):
        stack.remove("n0")
    with pytest.raises(ClipsError, match="cannot be removed"):
        stack.remove("log")
    with pytest.raises(ClipsError, match="priority 2001"):
        stack.add(logger(lines, "x", priority=2001))


def test_lines_of_an_environment_go_through_them(bus, log, lines):
    env = ClipsEnvironment("agent", bus)
    env.loggers.add(logger(lines, "mine", level=Level.WARN, replaces=True))
    env.eval('(progn (printout t "calm" crlf) (printout warn "alarm" crlf))')
    env.destroy()
    assert lines == [("mine", "W", "alarm")]
    assert [line.text for line in log.lines if line.component == "CLIPS (agent)"] == ["calm"]
