"""Plugins over the wire."""

from __future__ import annotations

import pytest

from cxbridge.blackboard.fawkesnet.components.plugins import Plugin, PluginManager
from cxbridge.blackboard.fawkesnet.messages.plugins import Kind, PluginMessage
from cxbridge.errors import CxbridgeError


class Host:
    """Two plugins; the second cannot be loaded, the third fails in another way."""

    def __init__(self) -> None:
        self.names = ["skiller"]

    def available(self) -> list[Plugin]:
        return [Plugin("skiller", "runs skills"), Plugin("broken", "")]

    def loaded(self) -> list[str]:
        return self.names

    def load(self, name: str) -> None:
        if name == "broken":
            raise CxbridgeError("it is broken")
        if name == "bug":
            raise ZeroDivisionError
        if name not in self.names:
            self.names.append(name)

    def unload(self, name: str) -> None:
        if name == "broken":
            raise CxbridgeError("it is broken")
        self.names.remove(name)


@pytest.fixture
def manager(site):
    manager = PluginManager(Host(), site.bus.logger("PluginManager").warn)
    site.start(components=[manager])
    return manager


def test_lists(site, manager):
    client = site.raw()
    available = client.ask(PluginMessage(Kind.LIST_AVAIL))
    assert available == PluginMessage(Kind.AVAIL_LIST, items=("skiller", "runs skills", "broken", ""))
    assert client.ask(PluginMessage(Kind.LIST_LOADED)) == PluginMessage(Kind.LOADED_LIST, items=("skiller",))


@pytest.mark.parametrize(
    ("kind", "name", "answer"),
    [
        (Kind.LOAD, "executive", Kind.LOADED),
        (Kind.LOAD, "skiller", Kind.LOADED),
        (Kind.LOAD, "broken", Kind.LOAD_FAILED),
        (Kind.LOAD, "bug", Kind.LOAD_FAILED),
        (Kind.UNLOAD, "skiller", Kind.UNLOADED),
        (Kind.UNLOAD, "broken", Kind.UNLOAD_FAILED),
    ],
)
def test_loading_and_unloading_are_answered(site, manager, kind, name, answer):
    assert site.raw().ask(PluginMessage(kind, name)) == PluginMessage(answer, name)


def test_failures_are_logged(site, manager):
    site.raw().ask(PluginMessage(Kind.LOAD, "broken"))
    site.wait_warning("it is broken")
    site.raw().ask(PluginMessage(Kind.LOAD, "bug"))
    site.wait_warning("ZeroDivisionError")


def test_watchers_hear_of_everybodys_plugins(site, manager):
    watcher = site.raw()
    watcher.send(PluginMessage(Kind.SUBSCRIBE_WATCH).to_frame())
    assert watcher.ask(PluginMessage(Kind.LIST_LOADED)).kind is Kind.LOADED_LIST
    manager.tell_loaded("executive")
    manager.tell_unloaded("executive")
    assert watcher.message() == PluginMessage(Kind.LOADED, "executive")
    assert watcher.message() == PluginMessage(Kind.UNLOADED, "executive")
    watcher.send(PluginMessage(Kind.UNSUBSCRIBE_WATCH).to_frame())
    assert watcher.ask(PluginMessage(Kind.LIST_LOADED)).kind is Kind.LOADED_LIST
    manager.tell_loaded("executive")
    assert watcher.ask(PluginMessage(Kind.LIST_LOADED)).kind is Kind.LOADED_LIST
