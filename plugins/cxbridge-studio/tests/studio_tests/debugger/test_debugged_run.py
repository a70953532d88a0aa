"""The debugger stops runs without a change of their decisions."""

from __future__ import annotations

import pytest

from cxbridge.clock import MICROSECONDS
from cxbridge.events import Event, RuleFired
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.run.agent import Run
from cxbridge.run.options import RunOptions
from cxbridge_studio.debugger.debugger import debugger_of
from tests.run.mini import write_scenario


def run_debugged(folder, specs, on_stop=None, steps=""):
    """Run the small scenario; return its events and the reasons of the stops."""
    events: list[Event] = []
    reasons: list[str] = []
    with Run(RunOptions(scenario=folder)) as assembly:
        assembly.bus.subscribe(events.append, RuleFired, *TRANSITION_TYPES)
        debugger = debugger_of(assembly.executive)

        def continue_run(stop):
            reasons.append(stop.reason)
            debugger.step(steps) if steps else debugger.go_on()

        debugger.on_stop = on_stop or continue_run
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
    return run_debugged(folder, [])[0]


def test_run_stops_at_goals_actions_and_skills(folder, undisturbed):
    events, reasons = run_debugged(
        folder, ["goal:MINI:DISPATCHED", "action:act:FINAL", "skill:say*:S_RUNNING"]
    )
    assert reasons == [
        "at goal G (MINI) is DISPATCHED",
        'at skill say{text="hello", wait=true} of Skiller is S_RUNNING',
        "at action act (G/P/1) is FINAL",
    ]
    assert events == undisturbed


@pytest.mark.parametrize("specs", [["rule:*"], ["after:mini-*", "rule:mini-*"], ["goal:*", "rule:nothing"]])
def test_stopped_run_has_events_of_undisturbed_run(folder, undisturbed, specs):
    events, reasons = run_debugged(folder, specs)
    assert len(reasons) > 5
    assert events == undisturbed


@pytest.mark.parametrize("unit", ["rule", "loop", "transition"])
def test_stepped_run_has_events_of_undisturbed_run(folder, undisturbed, unit):
    events, reasons = run_debugged(folder, ["goal:MINI:FORMULATED"], steps=unit)
    assert len(reasons) > 10
    assert events == undisturbed
