"""The local blackboard, beyond the contract of all blackboards."""

from __future__ import annotations

import logging

import pytest

from cxbridge.blackboard import LocalBlackBoard, Observer, errors
from cxbridge.clock import VirtualClock
from cxbridge.errors import InterfaceDefinitionError
from cxbridge.interfaces import InterfaceRegistry
from tests.blackboard.samples import SampleInterface, SampleRegistry


@pytest.fixture
def board() -> LocalBlackBoard:
    return LocalBlackBoard(SampleRegistry(), VirtualClock())


def test_board_refuses_instance_of_another_board(board):
    foreign = LocalBlackBoard(SampleRegistry(), VirtualClock()).open_for_reading(SampleInterface, "a")
    board.open_for_reading(SampleInterface, "a")
    with pytest.raises(errors.ForeignInstanceError, match="SampleInterface::a was not opened on this"):
        board.close(foreign)
    assert foreign.valid


def test_board_without_bus_logs_failed_observers(board, caplog):
    class Fails(Observer):
        def interface_created(self, interface_type, interface_id):
            raise ValueError("broken")

    board.register_observer(Fails())
    with caplog.at_level(logging.ERROR):
        board.open_for_reading(SampleInterface, "a")
    assert "interface_created of SampleInterface::a failed" in caplog.text


def test_wrong_definition_is_not_reported_as_unknown_type(tmp_path):
    (tmp_path / "WrongInterface.xml").write_text("<interface name='WrongInterface'>")
    board = LocalBlackBoard(InterfaceRegistry([tmp_path]), VirtualClock())
    with pytest.raises(InterfaceDefinitionError) as caught:
        board.open_for_reading("WrongInterface", "a")
    assert caught.value.file == str(tmp_path / "WrongInterface.xml")


def test_number_of_destroyed_interface_is_not_reused(board):
    first = board.open_for_reading(SampleInterface, "a")
    number = first.mem_serial
    first.close()
    assert board.open_for_reading(SampleInterface, "a").mem_serial > number
