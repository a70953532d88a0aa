"""Definitions of equal layout in other words: Fawkes' and ours."""

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
    made = InterfaceRegistry()
    made.add(make_interface_class(schema))
    return made


FAWKES = replace(SKILLER, hash=known_hashes(SKILLER)[0])
PAIRS = {"a daemon with Fawkes' files": (FAWKES, SKILLER), "a client with them": (SKILLER, FAWKES)}


@pytest.mark.parametrize("pair", PAIRS)
def test_clients_reach_a_daemon_with_definitions_of_equal_layout(tmp_path, pair):
    """Every client of a daemon with --fawkes-dir was refused, "cxbridge skill exec" among them."""
    at_server, at_client = PAIRS[pair]
    url = f"ipc://{tmp_path}/board"
    board = LocalBlackBoard(registry(at_server), RealClock())
    here = board.open_for_writing("SkillerInterface", "Skiller")
    with (
        ZmqBlackBoardServer(board, [url]),
        ZmqBlackBoard(url, registry(at_client), RealClock()) as client,
    ):
        reader = client.open_for_reading("SkillerInterface", "Skiller")
        here.set("skill_string", "say{}")
        here.write()
        client.flush()
        assert reader.read()
        assert reader.get("skill_string") == "say{}"
        message = reader.create_message("ExecSkillMessage")
        message.set("skill_string", "x{}")
        reader.msgq_enqueue(message)
        taken = here.msgq_pop()
        assert taken is not None
        assert taken.get("skill_string") == "x{}"
        writer = client.open_for_writing("SkillerInterface", "Other")
        local = board.open_for_reading("SkillerInterface", "Other")
        local.msgq_enqueue(local.create_message("StopExecMessage"))
        assert writer.msgq_size() == 1
