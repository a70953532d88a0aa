"""Managed nodes and their manager."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.clock import VirtualClock
from cxbridge.errors import ConfigError
from cxbridge.events import EventBus, LogLine
from cxbridge.run.components.component import Component
from cxbridge.run.components.manager import (
    ComponentManager,
    FailurePolicy,
    LifecycleError,
    ManagedNode,
    State,
    Transition,
)

STEPS = ("configure", "activate", "deactivate", "cleanup")


class Part(Component):
    """Records its steps, and fails at the steps that the test names."""

    def __init__(self, node):
        self.node = node

    def configure(self):
        self.node.note("configure")

    def abort(self):
        """Release nothing: a component with a failed configuration has acquired nothing."""

    def activate(self):
        self.node.note("activate")

    def deactivate(self):
        self.node.note("deactivate")

    def close(self):
        self.node.note("cleanup")

    def check(self):
        if "check" in self.node.fails:
            raise ConfigError("not well", hint="see a doctor")


class Node(ManagedNode[Part]):
    def __init__(self, name, diary, *, fails=()):
        super().__init__(name, lambda: Part(self), Part)
        self.diary = diary
        self.fails = set(fails)

    def note(self, step):
        self.diary.append(f"{step} {self.name}")
        if step in self.fails:
            raise ValueError(f"{step} on purpose")


class Rig:
    def __init__(self, *, policy=FailurePolicy.STOP, names="abc", **fails):
        self.clock = VirtualClock()
        bus = EventBus(self.clock)
        self.log: list[tuple[str, str]] = []
        bus.subscribe(self.note, LogLine)
        self.diary: list[str] = []
        self.nodes = [Node(name, self.diary, fails=fails.get(name, ())) for name in names]
        self.manager = ComponentManager(
            self.nodes,
            self.clock,
            None if policy is FailurePolicy.RAISE else bus.logger("L"),
            policy=policy,
            on_change=lambda: None,
        )

    def note(self, line):
        self.log.append((line.level.value, line.text))

    def states(self):
        return [status.state for status in self.manager.status()]

    def reasons(self):
        return [status.reason for status in self.manager.status()]

    def take_diary(self):
        steps = self.diary[:]
        self.diary.clear()
        return steps


def test_stop_has_reverse_order_of_start():
    rig = Rig()
    rig.manager.startup()
    assert rig.take_diary() == [
        "configure a",
        "configure b",
        "configure c",
        "activate a",
        "activate b",
        "activate c",
    ]
    assert rig.states() == [State.ACTIVE] * 3
    rig.manager.shutdown()
    assert rig.take_diary() == [
        "deactivate c", "cleanup c", "deactivate b", "cleanup b", "deactivate a", "cleanup a",
    ]  # fmt: skip
    assert rig.states() == [State.FINALIZED] * 3
    rig.manager.shutdown()
    assert rig.take_diary() == []


def test_pause_and_resume_skip_steady_components():
    rig = Rig()
    rig.nodes[0].steady = True
    rig.manager.startup()
    rig.take_diary()
    rig.manager.pause()
    assert rig.take_diary() == ["deactivate c", "deactivate b"]
    assert rig.reasons() == ["", "paused", "paused"]
    rig.manager.resume()
    assert rig.take_diary() == ["activate b", "activate c"]
    assert rig.reasons() == ["", "", ""]


def test_failed_component_stops_start():
    rig = Rig(b=["activate"])
    rig.manager.startup()
    assert rig.states() == [State.ACTIVE, State.INACTIVE, State.INACTIVE]
    assert rig.reasons() == ["", "ValueError: activate on purpose", ""]
    assert rig.manager.failure == "b: ValueError: activate on purpose"
    assert ("E", "b cannot activate: ValueError: activate on purpose") in rig.log


def test_failed_start_keeps_components_with_policy_continue():
    rig = Rig(policy=FailurePolicy.CONTINUE, b=["configure"])
    rig.manager.startup()
    assert rig.states() == [State.ACTIVE, State.UNCONFIGURED, State.ACTIVE]
    assert rig.manager.failure == ""
    rig.nodes[1].fails.clear()
    rig.manager.reset()


def test_component_with_failed_work_is_deactivated():
    rig = Rig(policy=FailurePolicy.CONTINUE)
    rig.manager.startup()
    rig.take_diary()
    worked = []

    def broken():
        worked.append(1)
        raise KeyError("x")

    step = rig.manager.guarded(rig.nodes[1], broken)
    step()
    step()
    assert len(worked) == 1
    assert rig.take_diary() == ["deactivate b", "cleanup b"]
    assert rig.states() == [State.ACTIVE, State.UNCONFIGURED, State.ACTIVE]
    assert rig.reasons()[1] == "KeyError: 'x'"
    assert rig.manager.failure == ""


def test_watch_finds_failed_component():
    rig = Rig(policy=FailurePolicy.CONTINUE, a=["check"])
    rig.manager.startup()
    rig.manager.check_active()
    assert rig.states()[0] is State.UNCONFIGURED
    assert rig.reasons()[0] == "not well; hint: see a doctor"


def test_failure_at_shutdown_does_not_stop_shutdown():
    rig = Rig(c=["deactivate", "cleanup"])
    rig.manager.startup()
    rig.manager.shutdown()
    assert rig.states() == [State.FINALIZED] * 3
    assert rig.take_diary()[-6:] == [
        "deactivate c", "cleanup c", "deactivate b", "cleanup b", "deactivate a", "cleanup a",
    ]  # fmt: skip
    assert rig.reasons()[2] == "ValueError: deactivate on purpose"


@pytest.mark.parametrize("step", STEPS[1:])
def test_transition_from_wrong_state_is_refused(step):
    with pytest.raises(LifecycleError, match="n is unconfigured, expected "):
        Node("n", []).take_transition(Transition(step))


@given(
    fails=st.dictionaries(st.sampled_from("abc"), st.sets(st.sampled_from(STEPS))),
    commands=st.lists(st.sampled_from(["startup", "pause", "resume", "reset", "check_active"]), max_size=8),
    policy=st.sampled_from([FailurePolicy.STOP, FailurePolicy.CONTINUE]),
)
def test_every_acquisition_is_released_once(fails, commands, policy):
    rig = Rig(policy=policy, **fails)
    for command in commands:
        getattr(rig.manager, command)()
    rig.manager.shutdown()
    assert rig.states() == [State.FINALIZED] * 3
    for node in rig.nodes:
        steps = [entry.split()[0] for entry in rig.diary if entry.endswith(node.name)]
        done = [step for step in steps if step not in node.fails or step in ("deactivate", "cleanup")]
        assert done.count("configure") == done.count("cleanup")
        assert done.count("activate") == done.count("deactivate")


def test_policy_raise_raises_error_and_closes_components():
    rig = Rig(policy=FailurePolicy.RAISE, b=["configure", "cleanup"], c=["cleanup"])
    rig.manager.start(rig.nodes[0])
    rig.manager.start(rig.nodes[2])
    with pytest.raises(ValueError, match="configure on purpose"):
        rig.manager.start(rig.nodes[1])
    rig.take_diary()
    with pytest.raises(ValueError, match="cleanup on purpose"):
        rig.manager.shutdown()
    assert rig.take_diary() == ["deactivate c", "cleanup c", "cleanup b", "deactivate a", "cleanup a"]
    assert rig.states() == [State.FINALIZED] * 3
    assert rig.log == []


def test_manager_changes_single_component():
    rig = Rig()
    manager = rig.manager
    for transition, state in (
        ("configure", State.INACTIVE),
        ("activate", State.ACTIVE),
        ("deactivate", State.INACTIVE),
        ("cleanup", State.UNCONFIGURED),
        ("shutdown", State.FINALIZED),
    ):
        manager.change_component("b", transition)
        assert rig.nodes[1].state is state
    assert rig.diary == ["configure b", "activate b", "deactivate b", "cleanup b"]
    assert (rig.nodes[0].state, rig.nodes[1].reason) == (State.UNCONFIGURED, "shutdown on request")


def test_refused_transition_has_no_effect():
    rig = Rig()
    rig.manager.startup()
    for name, transition, what in (
        ("a", "configure", "it is active, expected unconfigured"),
        ("a", "cleanup", "it is active, expected inactive"),
        ("a", "fly", "no transition 'fly'"),
        ("x", "activate", "no component 'x' to change"),
    ):
        with pytest.raises(LifecycleError, match=what):
            rig.manager.change_component(name, transition)
    assert rig.reasons() == ["", "", ""]
    rig.nodes[2].steady = True
    with pytest.raises(LifecycleError, match="no component 'c' to change"):
        rig.manager.change_component("c", "deactivate")


def test_finalized_component_does_not_restart():
    """A request to load such a plug-in reported success without effect."""
    rig = Rig()
    rig.manager.startup()
    rig.manager.change_component("b", "shutdown")
    with pytest.raises(LifecycleError, match="b was shut down"):
        rig.manager.start_component("b")
    with pytest.raises(LifecycleError, match="it is finalized"):
        rig.manager.change_component("b", "shutdown")
    rig.manager.stop_component("b")
    rig.manager.reset()
    assert rig.states() == [State.ACTIVE, State.FINALIZED, State.ACTIVE]
    assert rig.reasons()[1] == "shutdown on request"
