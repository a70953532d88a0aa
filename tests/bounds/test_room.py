"""The memory that a client, or a sender, makes a server use is bounded, on every way to a blackboard."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack, suppress

import pytest

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.blackboard.errors import BlackBoardError, QueueFullError
from cxbridge.blackboard.kit.server import MAX_BLOCK_BYTES
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.blackboard.zmq import ZmqBlackBoard, ZmqBlackBoardServer
from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.interfaces.message import MAX_WAITING
from tests.fawkes import HAS_FAWKES, fawkes_server

LARGE = "RequestInterface"


def over_zmq(stack: ExitStack, board: LocalBlackBoard) -> BlackBoard:
    server = stack.enter_context(ZmqBlackBoardServer(board, ["tcp://127.0.0.1:*"]))
    return stack.enter_context(
        ZmqBlackBoard(server.endpoints[0], InterfaceRegistry(), board.clock, EventBus(board.clock))
    )


def over_fawkes_protocol(stack: ExitStack, board: LocalBlackBoard) -> BlackBoard:
    url = f"fawkes://127.0.0.1:{stack.enter_context(fawkes_server(board)).port}"
    return stack.enter_context(open_blackboard(url, InterfaceRegistry(), board.clock, EventBus(board.clock)))


@pytest.mark.parametrize("connect", [over_zmq, over_fawkes_protocol][: 1 + HAS_FAWKES])
def test_client_opens_large_interfaces_up_to_limit(
    connect: Callable[[ExitStack, LocalBlackBoard], BlackBoard],
):
    """1,500 readers of one interface took 763 MiB of the server."""
    with ExitStack() as stack:
        clock = VirtualClock()
        board = LocalBlackBoard(InterfaceRegistry(), clock, EventBus(clock))
        client = connect(stack, board)
        size = InterfaceRegistry().schema(LARGE).datasize
        opened = 0
        with suppress(BlackBoardError):
            while opened * size <= 2 * MAX_BLOCK_BYTES:
                client.open_for_reading(LARGE, "x", owner="greedy")
                opened += 1
        assert opened * size <= MAX_BLOCK_BYTES < (opened + 1) * size
        assert client.open_for_reading("SkillerInterface", "Skiller", owner="modest").valid


def test_unread_messages_are_refused_at_limit():
    clock = VirtualClock()
    board = LocalBlackBoard(InterfaceRegistry(), clock, EventBus(clock))
    board.open_for_writing("SpeechSynthInterface", "Flite", owner="deaf")
    reader = board.open_for_reading("SpeechSynthInterface", "Flite", owner="eager")
    for _ in range(MAX_WAITING):
        reader.msgq_enqueue(reader.create_message("SayMessage", "x"))
    with pytest.raises(QueueFullError):
        reader.msgq_enqueue(reader.create_message("SayMessage", "x"))
