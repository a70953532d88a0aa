"""Plugins over the wire."""

from __future__ import annotations

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge_fawkes.network.components.plugins import PluginManager
from cxbridge_fawkes.network.messages.plugins import PluginKind, PluginMessage


class Host:
    """Two plugins; the second cannot be loaded, the third fails in another way."""

    def __init__(self) -> None:
        self.names = ["skiller"]

    def list_available(self) -> list[tuple[str, str]]:
        return [("skiller", "runs skills"), ("broken", "")]

    def list_loaded(self) -> list[str]:
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
    available = client.ask(PluginMessage(PluginKind.LIST_AVAIL))
    assert available == PluginMessage(PluginKind.AVAIL_LIST, items=("skiller", "runs skills", "broken", ""))
    assert client.ask(PluginMessage(PluginKind.LIST_LOADED)) == PluginMessage(
        PluginKind.LOADED_LIST, items=("skiller",)
    )


@pytest.mark.parametrize(
    ("kind", "name", "answer"),
    [
        (PluginKind.LOAD, "executive", PluginKind.LOADED),
        (PluginKind.LOAD, "skiller", PluginKind.LOADED),
        (PluginKind.LOAD, "broken", PluginKind.LOAD_FAILED),
        (PluginKind.LOAD, "bug", PluginKind.LOAD_FAILED),
        (PluginKind.UNLOAD, "skiller", PluginKind.UNLOADED),
        (PluginKind.UNLOAD, "broken", PluginKind.UNLOAD_FAILED),
    ],
)
def test_loading_and_unloading_are_answered(site, manager, kind, name, answer):
    assert site.raw().ask(PluginMessage(kind, name)) == PluginMessage(answer, name)


def test_failures_are_logged(site, manager):
    site.raw().ask(PluginMessage(PluginKind.LOAD, "broken"))
    site.wait_warning("it is broken")
    site.raw().ask(PluginMessage(PluginKind.LOAD, "bug"))
    site.wait_warning("ZeroDivisionError")


def test_watchers_hear_of_everybodys_plugins(site, manager):
    watcher = site.raw()
    watcher.send(PluginMessage(PluginKind.SUBSCRIBE_WATCH).to_frame())
    assert watcher.ask(PluginMessage(PluginKind.LIST_LOADED)).kind is PluginKind.LOADED_LIST
    manager.notify_loaded("executive")
    manager.notify_unloaded("executive")
    assert watcher.message() == PluginMessage(PluginKind.LOADED, "executive")
    assert watcher.message() == PluginMessage(PluginKind.UNLOADED, "executive")
    watcher.send(PluginMessage(PluginKind.UNSUBSCRIBE_WATCH).to_frame())
    assert watcher.ask(PluginMessage(PluginKind.LIST_LOADED)).kind is PluginKind.LOADED_LIST
    manager.notify_loaded("executive")
    assert watcher.ask(PluginMessage(PluginKind.LIST_LOADED)).kind is PluginKind.LOADED_LIST
