"""Clients of Fawkes' protocol have the rights of all clients, also those with hand-made frames."""

from __future__ import annotations

from typing import Any

import pytest

from cxbridge.daemon.board import COMMANDS
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.rights import FRAME_RIGHTS
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.messages import configuration as config_messages
from cxbridge_fawkes.network.messages import logger as log_messages
from cxbridge_fawkes.network.messages import plugins as plugin_messages
from cxbridge_fawkes.network.messages.blackboard import BoardKind
from fawkes_tests.network.raw import raw_client
from tests.daemon.test_daemon import settings
from tests.daemon.test_rights import served


def test_every_frame_of_a_client_is_in_the_table():
    of_server = {"INTERFACE_LIST", "OPEN_SUCCESS", "OPEN_FAILURE", "WRITE"} | {
        kind.name for kind in BoardKind if BoardKind.READER_ADDED <= kind <= BoardKind.INTERFACE_DESTROYED
    }
    assert {kind.name for kind in BoardKind} - of_server == set(FRAME_RIGHTS["fawkes-blackboard"])
    answers = ("LOADED", "FAILED", "UNLOADED")
    plugins = {
        kind.name
        for kind in plugin_messages.PluginKind
        if not kind.name.endswith((*answers, "AVAIL_LIST", "LOADED_LIST"))
    } | {"LIST_LOADED"}
    assert plugins == set(FRAME_RIGHTS["fawkes-plugins"])
    config = {kind.name for kind in config_messages.ConfigKind if kind < 30 or kind >= 50}
    assert config == set(FRAME_RIGHTS["fawkes-configuration"])
    assert {kind.name for kind in log_messages.LogKind} - {"LOGMESSAGE"} == set(FRAME_RIGHTS["fawkes-logger"])


@pytest.mark.parametrize(
    ("text", "programs"),
    [
        ("cxbridge: {fawkes: {host: 192.168.0.1}}", False),
        ("cxbridge: {fawkes: {host: '::'}}", False),
        ("cxbridge: {fawkes: {host: robot}}", False),
        ("cxbridge: {fawkes: {host: 192.168.0.1, enable: false}}", True),
        ("cxbridge: {remote-programs: true, fawkes: {host: 192.168.0.1}}", True),
    ],
)
def test_programs_are_off_beyond_the_loopback(text, programs):
    assert settings(text).rights.programs is programs


def port_of(daemon: Any) -> int:
    return int(next(url for url in daemon.endpoints if url.startswith("fawkes")).rpartition(":")[2])


def test_without_control_a_frame_of_fawkes_protocol_changes_nothing(tmp_path):
    """With a bare socket: the client that we have would be too polite."""
    with served(tmp_path, remote_control=False) as (daemon, _lines, _marker):
        registry = InterfaceRegistry()
        with raw_client(port_of(daemon)) as client:
            daemon_class = registry.get("DaemonInterface")
            for kind, interface_id in (("TestInterface", "mine"), ("DaemonInterface", "other")):
                hash_ = registry.get(kind).SCHEMA.hash
                answer = client.ask(bb.Open(kind, interface_id, hash_, writing=True))
                assert isinstance(answer, bb.OpenFailure)
            opened = client.ask(
                bb.Open("DaemonInterface", "cxbridge", daemon_class.SCHEMA.hash, writing=False)
            )
            assert isinstance(opened, bb.OpenSuccess)
            for number, name in enumerate(COMMANDS, 1):
                message = daemon_class.MESSAGES[name]()
                client.send(
                    bb.WireMessage(
                        opened.serial, opened.serial, name, number, 0, message.to_bytes()
                    ).to_bytes()
                )
            client.send(bb.Data(opened.serial, opened.block, changed=True).to_bytes())
            set_ = config_messages.ConfigMessage(
                config_messages.ConfigKind.SET_STRING, "/clips-executive/spec", ("evil",)
            )
            client.send(set_.to_bytes())
            assert next_of(client, config_messages.ConfigMessage).kind == config_messages.ConfigKind.INV_VALUE
            unload = plugin_messages.PluginMessage(plugin_messages.PluginKind.UNLOAD, "executive")
            client.send(unload.to_bytes())
            refused = next_of(client, plugin_messages.PluginMessage)
            assert refused.kind is plugin_messages.PluginKind.UNLOAD_FAILED
        assert daemon.state == "RUNNING"
        assert daemon.config.get_str("/clips-executive/spec") == "mini"
        assert [info.id for info in daemon.board.list("DaemonInterface", "*")] == ["cxbridge"]


def next_of(client: Any, kind: type) -> Any:
    """The next message of a type."""
    while not isinstance(message := client.message(), kind):
        pass
    return message


def test_without_programs_the_configuration_does_not_change(tmp_path):
    with (
        served(tmp_path, remote_programs=False) as (daemon, _lines, marker),
        raw_client(port_of(daemon)) as client,
    ):
        path = "/clips-executive/specs/mini/init/stage-3/0/files"
        kind = config_messages.ConfigKind.SET_STRING
        client.send(config_messages.ConfigMessage(kind, path, (str(marker),)).to_bytes())
        assert next_of(client, config_messages.ConfigMessage).kind == config_messages.ConfigKind.INV_VALUE
        assert not marker.exists()
