"""Components of a daemon as plugins for Fawkes' tools."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from cxbridge.run.components.component import Component
from cxbridge.run.components.manager import ComponentManager, LifecycleError, ManagedNode, State
from cxbridge_fawkes.daemon_plugins import DaemonPlugins
from cxbridge_fawkes.network.components.plugins import PluginManager

WAIT_S = 20


class Part(Component):
    def __init__(self):
        pass


class Board(Part):
    steady = True


class Broken(Part):
    def configure(self):
        raise ValueError("on purpose")


PARTS = {"board": Board, "skiller": Part, "executive": Part}


@pytest.fixture
def manager():
    clock = VirtualClock()
    nodes = [ManagedNode(name, kind, kind) for name, kind in PARTS.items()]
    made = ComponentManager(nodes, clock, EventBus(clock).logger("L"))
    made.startup()
    return made


class Ask(threading.Thread):
    """Asks in a thread, as a server does."""

    def __init__(self, call, *args):
        super().__init__()
        self._call, self._args = call, args
        self.error: Any = None
        self.start()

    def run(self):
        try:
            self._call(*self._args)
        except LifecycleError as error:
            self.error = error

    def served_by(self, plugins):
        while self.is_alive():
            plugins.poll()
            self.join(0.001)
        return self.error


def test_those_that_serve_clients_are_no_plugins(manager):
    plugins = DaemonPlugins(manager, may_change=True)
    assert [name for name, _ in plugins.list_available()] == ["skiller", "executive"]
    assert plugins.list_loaded() == ["skiller", "executive"]


def test_unloading_and_loading(manager):
    plugins = DaemonPlugins(manager, may_change=True)
    assert Ask(plugins.unload, "skiller").served_by(plugins) is None
    assert plugins.list_loaded() == ["executive"]
    assert Ask(plugins.load, "skiller,executive").served_by(plugins) is None
    assert plugins.list_loaded() == ["skiller", "executive"]


@pytest.mark.parametrize("name", ["navgraph", "board", ""])
def test_what_is_not_there_cannot_be_changed(manager, name):
    plugins = DaemonPlugins(manager, may_change=True)
    for call in (plugins.load, plugins.unload):
        error = Ask(call, name).served_by(plugins)
        assert "there is no component" in error.message
    assert manager.nodes[0].state is State.ACTIVE


def test_a_request_that_was_given_up_is_not_carried_out_later(manager, monkeypatch):
    monkeypatch.setattr("cxbridge_fawkes.daemon_plugins.REPLY_TIMEOUT_S", 0)
    plugins = DaemonPlugins(manager, may_change=True)
    with pytest.raises(LifecycleError, match="skiller: no answer"):
        plugins.unload("skiller")
    assert plugins.poll() is False
    assert plugins.list_loaded() == ["skiller", "executive"]


def test_a_load_that_fails_is_an_error_for_the_client_and_not_the_end():
    clock = VirtualClock()
    manager = ComponentManager([ManagedNode("broken", Broken, Broken)], clock, EventBus(clock).logger("L"))
    plugins = DaemonPlugins(manager, may_change=True)
    error = Ask(plugins.load, "broken").served_by(plugins)
    assert error.message == "broken cannot configure: ValueError: on purpose"
    assert manager.failure == ""


def test_without_remote_control_nothing_changes(manager):
    plugins = DaemonPlugins(manager, may_change=False)
    with pytest.raises(LifecycleError, match="remote-control is off"):
        plugins.unload("skiller")


def test_whoever_waits_when_the_daemon_stops_is_told(manager):
    plugins = DaemonPlugins(manager, may_change=True)
    ask = Ask(plugins.unload, "skiller")
    while ask.is_alive():
        plugins.close()
        ask.join(0.001)
    assert "stopping" in ask.error.message


def test_watchers_hear_of_what_comes_and_goes_whoever_asked(manager):
    class Watch(PluginManager):
        def __init__(self):
            self.heard: list[str] = []

        def notify_loaded(self, name):
            self.heard.append(f"+{name}")

        def notify_unloaded(self, name):
            self.heard.append(f"-{name}")

    plugins = DaemonPlugins(manager, may_change=True)
    plugins.notify_watchers()
    watch = plugins.watchers = Watch()
    manager.pause()
    plugins.notify_watchers()
    plugins.notify_watchers()
    manager.resume()
    plugins.notify_watchers()
    assert watch.heard == ["-skiller", "-executive", "+skiller", "+executive"]
