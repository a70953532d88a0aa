"""Hit counts and log messages of breakpoints."""

from __future__ import annotations

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.errors import ExecutiveError
from cxbridge.events import EventBus, LogLine
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge_studio.debugger.breakpoints import parse_breakpoint
from cxbridge_studio.debugger.debugger import Debugger


@pytest.mark.parametrize(
    "spec",
    [
        "rule:a hit 3",
        "rule:a hit >=3 if (eq 1 1)",
        'goal:*:FINISHED if (eq 1 1) log "it is {(+ 1 2)}"',
        'rule:a hit %2 log "a"',
        'skill:say{text="a log b"}:S_FINAL if (f)',
    ],
)
def test_parsed_breakpoint_has_same_text(spec):
    assert str(parse_breakpoint(spec)) == spec


@pytest.mark.parametrize("hits", ["0", "x", "%0"])
def test_invalid_hit_count_is_an_error(hits):
    with pytest.raises(ExecutiveError, match="is not a hit count"):
        parse_breakpoint(f"rule:a hit {hits}")


@pytest.mark.parametrize(
    ("hits", "due"),
    [
        ("3", [3]),
        ("==3", [3]),
        (">3", [4, 5, 6]),
        (">=3", [3, 4, 5, 6]),
        ("<3", [1, 2]),
        ("<=3", [1, 2, 3]),
        ("%3", [3, 6]),
        ("", [1, 2, 3, 4, 5, 6]),
    ],
)
def test_breakpoint_is_due_at_its_counts(hits, due):
    breakpoint_ = parse_breakpoint("rule:a" + (f" hit {hits}" if hits else ""))
    assert [number for number in range(1, 7) if breakpoint_.stops_at_hit(number)] == due


@pytest.fixture(name="env")
def _env():
    env = ClipsEnvironment("executive", EventBus(VirtualClock()))
    env.build("(defrule count ?f <- (count ?n&:(< ?n 5)) => (retract ?f) (assert (count (+ ?n 1))))")
    env.assert_string("(count 0)")
    yield env
    env.destroy()


def test_breakpoint_stops_at_its_hit_count(env):
    debugger = Debugger(env)
    debugger.add("rule:count hit 3")
    debugger.run()
    assert [slots["implied"] for _, _, slots in env.facts("count")] == [(2,)]
    debugger.go_on()
    assert debugger.run() == 3


def test_log_breakpoint_does_not_stop(env):
    lines = []
    env.bus.subscribe(lambda event: lines.append(event.text), LogLine)
    debugger = Debugger(env)
    debugger.add(
        'rule:count if (any-factp ((?f count)) (= 1 (mod (nth$ 1 ?f:implied) 2))) log "{(+ 1 2)} {(x)}"'
    )
    assert debugger.run() == 5
    assert [line[:8] for line in lines] == ["3 {(x): "] * 2
