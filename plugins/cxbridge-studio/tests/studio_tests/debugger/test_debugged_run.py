"""The debugger in a whole run: it stops, and a run that was stopped decides as one that was not."""

from __future__ import annotations

import pytest

from cxbridge.clock import MICROSECONDS
from cxbridge.events import Event, RuleFired
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.run.agent import Run
from cxbridge.run.options import RunOptions
from cxbridge_studio.debugger.debugger import debugger_of
from tests.run.mini import write_scenario


def play(folder, specs, on_stop=None, steps=""):
    """Run the small scenario; return its events and the reasons of the stops."""
    events: list[Event] = []
    reasons: list[str] = []
    with Run(RunOptions(scenario=folder)) as assembly:
        assembly.bus.subscribe(events.append, RuleFired, *TRANSITION_TYPES)
        debugger = debugger_of(assembly.executive)

        def stopped(stop):
            reasons.append(stop.reason)
            debugger.step(steps) if steps else debugger.go_on()

        debugger.on_stop = on_stop or stopped
        for spec in specs:
            debugger.add(spec)
        assembly.start()
        assembly.executive.env.watcher.rules.set((), on=True)
        assembly.executive.env.watcher.set_hooks()
        end_us = assembly.clock.now_us() + 60 * MICROSECONDS
        assembly.loop.run(lambda: assembly.is_over or assembly.clock.now_us() > end_us)
        assert assembly.is_over
    return events, reasons


@pytest.fixture(name="folder", scope="module")
def _folder(tmp_path_factory):
    return write_scenario(tmp_path_factory.mktemp("mini"))


@pytest.fixture(name="undisturbed", scope="module")
def _undisturbed(folder):
    return play(folder, [])[0]


def test_it_stops_at_goals_actions_and_skills(folder, undisturbed):
    events, reasons = play(folder, ["goal:MINI:DISPATCHED", "action:act:FINAL", "skill:say*:S_RUNNING"])
    assert reasons == [
        "at goal G (MINI) is DISPATCHED",
        'at skill say{text="hello", wait=true} of Skiller is S_RUNNING',
        "at action act (G/P/1) is FINAL",
    ]
    assert events == undisturbed


@pytest.mark.parametrize("specs", [["rule:*"], ["after:mini-*", "rule:mini-*"], ["goal:*", "rule:nothing"]])
def test_a_run_that_was_stopped_decides_as_one_that_was_not(folder, undisturbed, specs):
    events, reasons = play(folder, specs)
    assert len(reasons) > 5
    assert events == undisturbed


@pytest.mark.parametrize("what", ["rule", "loop", "transition"])
def test_stepping_through_a_run(folder, undisturbed, what):
    events, reasons = play(folder, ["goal:MINI:FORMULATED"], steps=what)
    assert len(reasons) > 10
    assert events == undisturbed
