"""The configuration over Fawkes' protocol."""

from __future__ import annotations

import pytest

from cxbridge.config import Configuration
from cxbridge_fawkes.network.components.configuration import ConfigurationComponent
from cxbridge_fawkes.network.messages.configuration import (
    CHANGING_KINDS,
    GET_KINDS,
    ConfigKind,
    ConfigMessage,
)
from cxbridge_fawkes.network.messages.fields import unpack_list
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame

TEXT = """
a: {uint: 42, int: -1, float: 0.5, bool: true, text: test, big: 99999999999, empty: []}
list: [1, 2, 3]
words: [x, y z]
mixed: [1, x]
cxbridge: {web: {token: 0123456789abcdef}, robot-memory: {uri: "mongodb://me:pw@host/"}}
"""


@pytest.fixture
def config():
    return Configuration.from_text(TEXT)


@pytest.fixture
def client(site, config):
    site.start(components=[ConfigurationComponent(config)])
    return site.raw()


def ask(client, kind, path=""):
    client.send(FawkesFrame(ComponentId.CONFIGURATION, kind, path.encode().ljust(132, b"\0")))
    return client.take()


@pytest.mark.parametrize(
    ("path", "kind", "values", "is_list"),
    [
        ("/a/uint", ConfigKind.UINT_VALUE, (42,), False),
        ("/a/int", ConfigKind.INT_VALUE, (-1,), False),
        ("/a/float", ConfigKind.FLOAT_VALUE, (0.5,), False),
        ("/a/bool", ConfigKind.BOOL_VALUE, (True,), False),
        ("/a/text", ConfigKind.STRING_VALUE, ("test",), False),
        ("/a/big", ConfigKind.STRING_VALUE, ("99999999999",), False),
        ("/list", ConfigKind.UINT_VALUE, (1, 2, 3), True),
        ("/words", ConfigKind.STRING_VALUE, ("x", "y z"), True),
        ("/a/empty", ConfigKind.STRING_VALUE, ("",), False),
        ("/mixed", ConfigKind.STRING_VALUE, ("1", "x"), True),
        ("/cxbridge/web/token", ConfigKind.STRING_VALUE, ("(not told)",), False),
        ("/cxbridge/robot-memory/uri", ConfigKind.STRING_VALUE, ("mongodb://(not told)@host/",), False),
        ("/a", ConfigKind.INV_VALUE, (), False),
        ("/none", ConfigKind.INV_VALUE, (), False),
    ],
)
def test_value_has_own_type_for_each_requested_type(client, path, kind, values, is_list):
    for question in GET_KINDS:
        assert ask(client, question, path) == ConfigMessage(kind, path, values, is_list).to_frame()


def test_subscriber_gets_all_values(client):
    reply = ask(client, ConfigKind.SUBSCRIBE)
    assert reply.kind == ConfigKind.LIST
    assert b"0123456789abcdef" not in reply.payload
    entries = unpack_list(reply.payload, "LIST")
    paths = [entry.partition(b"\0")[0].decode() for entry in entries]
    assert paths == sorted(paths)
    assert {"/a/uint", "/words"} <= set(paths)
    assert ConfigMessage(ConfigKind.UINT_VALUE, "/a/uint", (42,)).pack_entry() in entries
    client.send(FawkesFrame(ComponentId.CONFIGURATION, ConfigKind.UNSUBSCRIBE))
    assert ask(client, 6, "/none").kind == ConfigKind.INV_VALUE


@pytest.mark.parametrize("kind", CHANGING_KINDS)
def test_clients_cannot_change_values(site, client, config, kind):
    before = list(config.search("/"))
    assert ask(client, kind, "/a/uint") == ConfigMessage(ConfigKind.INV_VALUE, "/a/uint").to_frame()
    site.wait_warning("read only for clients")
    assert list(config.search("/")) == before
