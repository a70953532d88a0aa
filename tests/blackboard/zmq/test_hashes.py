"""Definitions of Fawkes and of cxbridge with equal layout and different hashes."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.zmq import ZmqBlackBoard, ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.known_hashes import known_hashes
from cxbridge.interfaces.schema import InterfaceSchema

SKILLER = InterfaceRegistry().schema("SkillerInterface")


def registry(schema: InterfaceSchema) -> InterfaceRegistry:
    new_registry = InterfaceRegistry()
    new_registry.add(make_interface_class(schema))
    return new_registry


FAWKES = replace(SKILLER, hash=known_hashes(SKILLER)[0])
PAIRS = {"server with Fawkes' files": (FAWKES, SKILLER), "client with Fawkes' files": (SKILLER, FAWKES)}


@pytest.mark.parametrize("pair", PAIRS)
def test_clients_reach_a_daemon_with_definitions_of_equal_layout(tmp_path, pair):
    """A daemon with --fawkes-dir refused all clients, e.g. "cxbridge skill exec"."""
    server_schema, client_schema = PAIRS[pair]
    url = f"ipc://{tmp_path}/board"
    board = LocalBlackBoard(registry(server_schema), RealClock())
    server_writer = board.open_for_writing("SkillerInterface", "Skiller")
    with (
        ZmqBlackBoardServer(board, [url]),
        ZmqBlackBoard(url, registry(client_schema), RealClock()) as client,
    ):
        reader = client.open_for_reading("SkillerInterface", "Skiller")
        server_writer.set("skill_string", "say{}")
        server_writer.write()
        client.flush()
        assert reader.read()
        assert reader.get("skill_string") == "say{}"
        message = reader.create_message("ExecSkillMessage")
        message.set("skill_string", "x{}")
        reader.msgq_enqueue(message)
        received = server_writer.msgq_pop()
        assert received is not None
        assert received.get("skill_string") == "x{}"
        writer = client.open_for_writing("SkillerInterface", "Other")
        local = board.open_for_reading("SkillerInterface", "Other")
        local.msgq_enqueue(local.create_message("StopExecMessage"))
        assert writer.msgq_size() == 1
