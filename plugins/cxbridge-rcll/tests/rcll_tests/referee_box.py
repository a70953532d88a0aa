"""A referee box as small as one can be: a program with a server, which says how its game stands."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cxbridge_protobuf.inbox import ConnectionChange, ReceivedMessage
from cxbridge_protobuf.network import Network
from cxbridge_protobuf.settings import NetworkSettings
from cxbridge_protobuf.types import Message, MessageTypes, make_frame
from tests.support import free_port

MESSAGES = """
syntax = "proto2";
package llsf_msgs;
enum Team { CYAN = 0; MAGENTA = 1; }
enum Zone { C_Z11 = 1011; C_Z42 = 1042; }
message Time { required int64 sec = 1; required int64 nsec = 2; }
message SetTeamName { enum CompType { COMP_ID = 2000; MSG_TYPE = 1; }
  required string team_name = 1; required Team team_color = 2; }
message SetGamePhase { enum CompType { COMP_ID = 2000; MSG_TYPE = 2; } required GameState.Phase phase = 1; }
message SetGameState { enum CompType { COMP_ID = 2000; MSG_TYPE = 3; } required GameState.State state = 1; }
message GameState { enum CompType { COMP_ID = 2000; MSG_TYPE = 4; }
  enum State { WAIT_START = 1; RUNNING = 2; }
  enum Phase { PRE_GAME = 0; SETUP = 10; PRODUCTION = 30; POST_GAME = 40; }
  required Time game_time = 1; required State state = 3; required Phase phase = 4;
  optional uint32 points_cyan = 5; optional uint32 points_magenta = 8; }
message Machine { enum CompType { COMP_ID = 2000; MSG_TYPE = 12; }
  required string name = 1; optional string type = 2; optional string state = 3;
  optional Zone zone = 11; optional uint32 rotation = 12; }
message MachineInfo { enum CompType { COMP_ID = 2000; MSG_TYPE = 13; } repeated Machine machines = 1; }
message Order { enum CompType { COMP_ID = 2000; MSG_TYPE = 42; }
  enum Complexity { C0 = 0; C1 = 1; }
  required uint32 id = 1; required Complexity complexity = 2;
  required uint32 quantity_delivered_cyan = 7; required uint32 quantity_delivered_magenta = 8;
  required uint32 delivery_period_begin = 9; required uint32 delivery_period_end = 10; }
message OrderInfo { enum CompType { COMP_ID = 2000; MSG_TYPE = 41; } repeated Order orders = 1; }
message MachineAddBase { enum CompType { COMP_ID = 2000; MSG_TYPE = 101; } required string machine_name = 1; }
"""

_PAUSE_S = 0.01


def write_messages(folder: Path) -> Path:
    """Write the message definitions; return their folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "league.proto").write_text(MESSAGES)
    return folder


def message_types(folder: Path) -> MessageTypes:
    """Return the types of messages in a folder."""
    types = MessageTypes(lambda text: None)
    types.add_folders((write_messages(folder),))
    return types


class RefereeBox:
    """Gives five points and takes a delivery as soon as the production has begun, and continues by itself.

    :param types: its messages.
    :param speed: how fast its time passes.
    """

    def __init__(self, types: MessageTypes, speed: float = 1.0) -> None:
        self.port = free_port()
        self.phase, self.points, self.bases = "PRE_GAME", 0, 0
        self.is_silent = False
        self.rounds = 0
        """How often it has said in the production how the game stands."""
        self.game_time = 0.0
        self._types, self._speed = types, speed
        self._network = Network(types, NetworkSettings(), lambda: time.monotonic_ns() // 1000)
        self._clients: list[int] = []
        self._network.enable_server(self.port)
        self._is_closed = threading.Event()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def _work(self) -> None:
        begun = time.monotonic()
        while not self._is_closed.wait(_PAUSE_S):
            for event in self._network.drain():
                if isinstance(event, ConnectionChange) and event.connected:
                    self._clients.append(event.link_id)
                elif isinstance(event, ConnectionChange):
                    self._clients.remove(event.link_id)
                elif isinstance(event, ReceivedMessage):
                    self._take(event.message)
            self.game_time = (time.monotonic() - begun) * self._speed
            for client in self._clients if not self.is_silent else ():
                for message in self._news():
                    self._network.send(client, make_frame(message))
            self.rounds += self.phase == "PRODUCTION"

    def _take(self, message: Message) -> None:
        if message.DESCRIPTOR.name == "SetGamePhase":
            kind = message.DESCRIPTOR.fields_by_name["phase"].enum_type
            self.phase = kind.values_by_number[message.phase].name
            self.points = 5 if self.phase == "PRODUCTION" else self.points
        elif message.DESCRIPTOR.name == "MachineAddBase":
            self.bases += 1

    def _news(self) -> Iterator[Message]:
        yield game_state(self._types, self.phase, self.game_time, cyan=self.points)
        yield machine_info(self._types, state="READY-AT-OUTPUT" if self.points else "IDLE")
        yield order_info(self._types, cyan=1 if self.points else 0)

    def close(self) -> None:
        """End, as a program that is killed."""
        if not self._is_closed.is_set():
            self._is_closed.set()
            self._thread.join()
            self._network.close()


@contextmanager
def referee_box(types: MessageTypes, speed: float = 1.0) -> Iterator[RefereeBox]:
    """Run a referee box."""
    box = RefereeBox(types, speed)
    try:
        yield box
    finally:
        box.close()


def game_state(types: MessageTypes, phase: str, game_time: float, cyan: int = 0, magenta: int = 0) -> Message:
    """Return how a game stands."""
    message = types.create("llsf_msgs.GameState")
    message.game_time.sec, message.game_time.nsec = int(game_time), int(game_time % 1 * 1e9)
    message.state = 2
    message.phase = message.DESCRIPTOR.fields_by_name["phase"].enum_type.values_by_name[phase].number
    message.points_cyan, message.points_magenta = cyan, magenta
    return message


def machine_info(types: MessageTypes, name: str = "C-BS", kind: str = "BS", state: str = "IDLE") -> Message:
    """Return the state of a machine in zone C-Z42."""
    message = types.create("llsf_msgs.MachineInfo")
    machine = message.machines.add()
    machine.name, machine.type, machine.state = name, kind, state
    machine.zone, machine.rotation = 1042, 90
    return message


def order_info(types: MessageTypes, cyan: int = 0) -> Message:
    """Return an order of complexity C1."""
    message = types.create("llsf_msgs.OrderInfo")
    order = message.orders.add()
    order.id, order.complexity = 7, 1
    order.delivery_period_begin, order.delivery_period_end = 30, 90
    order.quantity_delivered_cyan, order.quantity_delivered_magenta = cyan, 0
    return message
