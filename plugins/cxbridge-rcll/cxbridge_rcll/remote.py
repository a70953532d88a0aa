"""A referee box in another process, which gets instructions and reports the game over a TCP connection."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final, NamedTuple, Self

from cxbridge.clock import MICROSECONDS
from cxbridge.config import Configuration
from cxbridge.errors import CxbridgeError, ProtobufError
from cxbridge.executive.host.values import Value
from cxbridge.listening import is_loopback
from cxbridge.mainloop import Hook
from cxbridge.numbers import parse_decimal
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge_explore.game.judge import GameState
from cxbridge_explore.game.score import Score
from cxbridge_protobuf.inbox import ConnectionChange, InboxEvent, LogWarning, ReceivedMessage
from cxbridge_protobuf.network import Network
from cxbridge_protobuf.settings import NetworkSettings
from cxbridge_protobuf.types import Message, MessageTypes, make_frame
from cxbridge_rcll.controller import MESSAGE_PACKAGE, Controller, Phase, Timeline
from cxbridge_rcll.reported_game import ReportedGame, ReportedMachine

# the real time to wait for the first game state, which a referee box sends several times a second
_FIRST_STATE_TIMEOUT_S: Final = 5.0

_POLL_S: Final = 0.02  # the real time between two polls for messages while the connection opens
_SPECS_PATH: Final = "/clips-executive/specs"
_PEER_ADDRESS_PATH: Final = "parameters/rcll/peer-address"
_MAX_PORT: Final = 65535
# the time over which the speeds of the clocks are compared, which is long compared with the delay of a
# message
_MEASUREMENT_S: Final = 20.0
_MAX_SPEED_ERROR: Final = 0.2  # the tolerated difference of the speeds, since some messages are late


class Address(NamedTuple):
    """The address of a referee box."""

    host: str
    port: int

    @classmethod
    def parse(cls, text: str) -> Self:
        """Parse ``HOST:PORT``.

        :raises CxbridgeError: if the text has another form.
        """
        host, colon, port = text.rpartition(":")
        port_number = parse_decimal(port)
        if not colon or not host or port_number is None or not 0 < port_number <= _MAX_PORT:
            raise CxbridgeError(
                f"'{text}' is not the address of a referee box", hint="write HOST:PORT, e.g. localhost:4444"
            )
        return cls(host.strip("[]"), port_number)

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


class RemoteReferee:
    """A referee box in another process.

    :param message_folder: the folder with message definitions.
    """

    make_connections = None
    faults: Sequence[str] = ()

    def __init__(self, address: Address, message_folder: Path) -> None:
        self._address = address
        self._message_folder = message_folder
        self._client: RefereeClient | None = None

    def configure_agent(self, config: Configuration) -> None:
        """Set the agent's peer address to this host if the referee box runs on this host."""
        if not is_loopback(self._address.host):
            return
        for spec in config.keys(_SPECS_PATH):
            path = f"{_SPECS_PATH}/{spec}/{_PEER_ADDRESS_PATH}"
            if config.exists(path):
                config.set(path, "127.0.0.1")

    def component_factories(self, timeline: Timeline) -> Iterator[Callable[[Run], Component]]:
        """Yield the factories of the connection to the referee and of its controller."""

        def make_client(context: Run) -> Component:
            self._client = RefereeClient(context, self._address, self._message_folder)
            return self._client

        yield make_client
        yield lambda context: Controller(
            context, self._running_client.types, timeline, self._running_client.send
        )

    @property
    def _running_client(self) -> RefereeClient:
        assert self._client is not None  # the run has made its components before the first use
        return self._client

    def find_machine(self, name: str) -> ReportedMachine | None:
        return self._running_client.game.machines.get(name)

    def machine_facts(self) -> Iterator[dict[str, Value]]:
        return self._running_client.game.machine_facts()

    @property
    def score(self) -> Score:
        return self._running_client.game.score

    @property
    def state(self) -> GameState:
        return self._running_client.game.state

    @property
    def is_over(self) -> bool:
        return self._running_client.game.is_over


class RefereeClient(Component):
    """The connection to a referee box. The constructor waits for the first game state.

    :raises CxbridgeError: if no referee box of this league listens at the address, or its game has begun.
    """

    hooks = (Hook.SENSOR_ACQUIRE,)
    description = "Connection to a referee box"

    def __init__(self, context: Run, address: Address, message_folder: Path) -> None:
        self._address = address
        self._clock = context.clock
        self._log = context.bus.logger("Referee")
        self.types = MessageTypes(self._log.warn)
        self.types.add_folders((message_folder,))
        self.game = ReportedGame(self._send_payment)
        self._problem = ""
        self._is_lost = False
        # the run's time in microseconds and the referee's time in seconds, at the start of the comparison
        self._comparison_start: tuple[int, float] | None = None
        self._are_clocks_compared = False
        self._network = Network(self.types, NetworkSettings(), context.clock.now_us)
        try:
            self._link_id = self._network.connect(*address)
            self._wait_for_game_state()
        except Exception:
            self.close()
            raise

    def _wait_for_game_state(self) -> None:
        deadline_s = time.monotonic() + _FIRST_STATE_TIMEOUT_S
        while not self.game.phase:
            self._receive_messages()
            if self._is_lost:
                raise CxbridgeError(
                    f"there is no referee at {self._address}: {self._problem or 'the connection was closed'}",
                    hint="start the referee box, or name its server-port",
                )
            if time.monotonic() > deadline_s:
                raise CxbridgeError(
                    f"{self._address} has not reported the state of its game: "
                    f"{self._problem or 'no message was received'}",
                    hint="check the address, and the version of the message definitions",
                )
            time.sleep(_POLL_S)
        if self.game.phase != Phase.PRE_GAME:
            raise CxbridgeError(
                f"the game of the referee at {self._address} has begun: it is in {self.game.phase}",
                hint="restart the referee box",
            )

    def loop(self) -> None:
        """Handle the referee's messages, and compare the clocks."""
        self._receive_messages()
        self._compare_clocks()

    def _receive_messages(self) -> None:
        for event in self._network.drain():
            self._handle_event(event)

    def _handle_event(self, event: InboxEvent) -> None:
        match event:
            case ReceivedMessage(message=None):
                self._problem = self._problem or f"message {event.component}:{event.type}: {event.problem}"
            case ReceivedMessage():
                self.game.handle_message(event.message)
            case ConnectionChange(connected=False):
                self._is_lost = True
            case LogWarning():
                self._problem = event.text

    def _compare_clocks(self) -> None:
        """Log a warning once if the referee's time and the run's time have different speeds."""
        if self.game.phase != Phase.PRODUCTION or self._are_clocks_compared:
            return
        now_us = self._clock.now_us()
        if self._comparison_start is None:
            self._comparison_start = now_us, self.game.game_time
            return
        begin_us, begin_game_time = self._comparison_start
        seconds = (now_us - begin_us) / MICROSECONDS
        if seconds < _MEASUREMENT_S:
            return
        factor = (self.game.game_time - begin_game_time) / seconds
        if abs(factor - 1) > _MAX_SPEED_ERROR:
            self._log.warn(
                f"The referee's time passes {factor:.2f} times as fast as the game's; see --speed, and "
                "/llsfrb/simulation/speedup of the referee box"
            )
        self._are_clocks_compared = True

    def send(self, message: Message) -> None:
        """Send a message to the referee; do nothing if the connection is lost."""
        if not self._is_lost:
            try:
                self._network.send(self._link_id, make_frame(message))
            except ProtobufError as error:
                self._log.warn(f"{message.DESCRIPTOR.name} was not sent to the referee: {error.message}")

    def _send_payment(self, machine: str) -> None:
        message = self.types.create(f"{MESSAGE_PACKAGE}.MachineAddBase")
        message.machine_name = machine
        self.send(message)

    @property
    def loss_reason(self) -> str:
        """The reason why the game cannot end, if the connection is lost; empty otherwise."""
        if not self._is_lost or self.game.is_over:
            return ""
        moment = f"in {self.game.phase} at {self.game.game_time:g} s"
        return f"the referee at {self._address} has disconnected, {moment}"

    def close(self) -> None:
        self._network.close()
