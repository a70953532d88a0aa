"""The list of plugins over Fawkes' protocol."""

from __future__ import annotations

import pytest

from cxbridge_fawkes.network.components.plugins import PluginKind, PluginManager
from cxbridge_fawkes.network.messages.fields import unpack_list
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame

PLUGINS = [("skiller", "runs skills", True), ("broken", "", False)]


@pytest.fixture
def client(site):
    site.start(components=[PluginManager(lambda: PLUGINS)])
    return site.raw()


def ask(client, kind, payload=b""):
    client.send(FawkesFrame(ComponentId.PLUGIN_MANAGER, kind, payload))
    return client.take()


@pytest.mark.parametrize(
    ("question", "kind", "texts"),
    [
        (PluginKind.LIST_AVAIL, PluginKind.AVAIL_LIST, (b"skiller", b"runs skills", b"broken", b"")),
        (PluginKind.LIST_LOADED, PluginKind.LOADED_LIST, (b"skiller",)),
    ],
)
def test_plugin_manager_lists_available_and_loaded_plugins(client, question, kind, texts):
    reply = ask(client, question)
    assert (reply.kind, unpack_list(reply.payload, "a list")) == (kind, texts)


@pytest.mark.parametrize(
    ("question", "kind"),
    [(PluginKind.LOAD, PluginKind.LOAD_FAILED), (PluginKind.UNLOAD, PluginKind.UNLOAD_FAILED)],
)
def test_loading_and_unloading_are_refused(site, client, question, kind):
    name = b"broken".ljust(32, b"\0")
    assert ask(client, question, name) == FawkesFrame(ComponentId.PLUGIN_MANAGER, kind, name)
    site.wait_warning("may not load or unload plugins")
