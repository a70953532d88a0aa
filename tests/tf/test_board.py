"""Transforms over the blackboard: publishers and listeners."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.space.tf import StampedTransform, Transform, TransformListener, TransformPublisher


@pytest.fixture
def board() -> Iterator[LocalBlackBoard]:
    with LocalBlackBoard(InterfaceRegistry(), VirtualClock()) as board:
        yield board


def entry(x: float, at: int = 5, child: str = "base_link") -> StampedTransform:
    return StampedTransform(Transform((x, 0.0, 0.0)), at, "map", child)


def x_of(listener: TransformListener, child: str = "base_link", at: int = 0) -> float:
    return listener.buffer.lookup("map", child, at).transform.translation[0]


def test_each_write_is_heard(board: LocalBlackBoard):
    publisher = TransformPublisher(board, "/tf/base")
    publisher.send(entry(1.0, at=1_000_000))
    listener = TransformListener(board)
    publisher.send(entry(3.0, at=2_000_000))
    assert x_of(listener, at=1_500_000) == 2.0


def test_static_transforms_hold_for_all_times(board: LocalBlackBoard):
    listener = TransformListener(board)
    TransformPublisher(board, "laser").send(entry(1.0, at=50, child="laser"), static=True)
    assert x_of(listener, "laser", at=1) == 1.0


def test_what_is_not_written_yet_is_no_transform(board: LocalBlackBoard):
    listener = TransformListener(board)
    writer: Any = board.open_for_writing("TransformInterface", "/tf/x")
    writer.frame, writer.child_frame = "map", "x"
    writer.write()  # its rotation is all zero
    assert listener.buffer.frames == {}


def test_an_interface_goes_with_its_writer(board: LocalBlackBoard):
    listener = TransformListener(board)
    for x in (1.0, 2.0):
        publisher = TransformPublisher(board, "base")
        publisher.send(entry(x, at=round(x)))
        publisher.close()
        assert board.list("TransformInterface") == []
    assert x_of(listener) == 2.0


def test_a_closed_listener_lets_go(board: LocalBlackBoard):
    listener = TransformListener(board)
    publisher = TransformPublisher(board, "base")
    listener.close()
    publisher.send(entry(1.0))
    TransformPublisher(board, "late").send(entry(1.0, child="late"))
    assert listener.buffer.frames == {}
    assert {info.num_readers for info in board.list("TransformInterface")} == {0}
