"""The rights of clients of Fawkes' protocol, including clients with hand-made frames."""

from __future__ import annotations

from typing import Any

import pytest

from cxbridge.daemon.interfaces import COMMANDS
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.rights import FRAME_RIGHTS
from cxbridge_fawkes.network.components.plugins import PluginKind
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.messages.blackboard import BoardKind
from cxbridge_fawkes.network.messages.configuration import CHANGING_KINDS, ConfigKind
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame
from fawkes_tests.network.raw import RawClient
from tests.daemon.test_daemon import settings
from tests.daemon.test_rights import served


def test_table_of_rights_has_all_client_frames():
    of_server = {"INTERFACE_LIST", "OPEN_SUCCESS", "OPEN_FAILURE"} | {
        kind.name for kind in BoardKind if BoardKind.READER_ADDED <= kind <= BoardKind.INTERFACE_DESTROYED
    }
    assert {kind.name for kind in BoardKind} - of_server == set(FRAME_RIGHTS["fawkes-blackboard"])


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
def test_host_beyond_loopback_forbids_programs(text, programs):
    assert settings(text).rights.programs is programs


def port_of(daemon: Any) -> int:
    return int(next(url for url in daemon.endpoints if url.startswith("fawkes")).rpartition(":")[2])


def test_frames_change_nothing_without_remote_control(tmp_path):
    """A bare socket sends the frames, because `FawkesBlackBoard` would not send them."""
    with served(tmp_path, remote_control=False) as (daemon, _lines, _marker):
        registry = InterfaceRegistry()
        with RawClient(port_of(daemon)) as client:
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
            client.send(bb.DataMessage(opened.serial, opened.block, changed=True).to_bytes())
            path = b"/clips-executive/spec".ljust(132, b"\0")
            for change in CHANGING_KINDS:
                client.send(FawkesFrame(ComponentId.CONFIGURATION, change, path + b"\4\0\0\0evil"))
                assert take_frame_of(client, ComponentId.CONFIGURATION).kind == ConfigKind.INV_VALUE
            plugin = b"executive".ljust(32, b"\0")
            client.send(FawkesFrame(ComponentId.PLUGIN_MANAGER, PluginKind.UNLOAD, plugin))
            assert take_frame_of(client, ComponentId.PLUGIN_MANAGER).kind == PluginKind.UNLOAD_FAILED
        assert daemon.state == "RUNNING"
        assert daemon.config.get_str("/clips-executive/spec") == "mini"
        assert [info.id for info in daemon.board.list("DaemonInterface", "*")] == ["cxbridge"]


def take_frame_of(client: RawClient, component: ComponentId) -> FawkesFrame:
    """Return the next frame of a component."""
    while (frame := client.take()).component != component:
        pass
    return frame
