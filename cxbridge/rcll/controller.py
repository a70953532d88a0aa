"""Instructions to the referee, who plays and which phase begins: what people do with rcll-refbox-instruct."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import ProtobufError
from cxbridge.executive.protobuf.local import HOST, LocalNetwork
from cxbridge.executive.protobuf.settings import NetworkSettings
from cxbridge.executive.protobuf.types import Message, MessageTypes, frame_of
from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge.run.context import RunContext


class Phase(StrEnum):
    """The phases of a game, as the referee calls them."""

    PRE_GAME = "PRE_GAME"
    SETUP = "SETUP"
    EXPLORATION = "EXPLORATION"
    PRODUCTION = "PRODUCTION"
    POST_GAME = "POST_GAME"


PACKAGE: Final = "llsf_msgs"
"""Of the league's messages."""

BEGIN_S: Final = 5.0
"""Seconds until the setup begins: by then the agent has begun to listen."""

SETUP_S: Final = 15.0
"""Seconds of the setup; the league's are 300, in which robots are only carried to their places."""


@dataclass(frozen=True, slots=True)
class Script:
    """How a game goes.

    :param cyan: the name of the team; empty: nobody plays cyan.
    :param magenta: the name of the team; empty: nobody plays magenta.
    :param production_s: seconds of the production; then the game is over.
    """

    cyan: str = ""
    magenta: str = ""
    production_s: float = 1200.0


class Controller(Component):
    """Instructs the referee, each time over a connection of its own.

    :param types: the league's messages.
    :param port: of the referee's server.
    :raises ProtobufError: when a message is missing that it sends.
    """

    hooks = (Hook.SENSOR_PREPARE,)
    description = "Leads through the phases of a game"

    def __init__(
        self, context: RunContext, network: LocalNetwork, types: MessageTypes, port: int, script: Script
    ) -> None:
        self._clock: Clock = context.clock
        self._connections = network.join(types, NetworkSettings(), self._clock.now_us)
        self._types = types
        self._port = port
        start = self._clock.now_us()
        teams = [("CYAN", script.cyan), ("MAGENTA", script.magenta)]
        production = BEGIN_S + SETUP_S
        steps: list[tuple[float, str, dict[str, str]]] = [
            (BEGIN_S, "SetTeamName", {"team_color": colour, "team_name": name})
            for colour, name in teams
            if name
        ]
        steps += [
            (BEGIN_S, "SetGamePhase", {"phase": Phase.SETUP}),
            (BEGIN_S, "SetGameState", {"state": "RUNNING"}),
            (production, "SetGamePhase", {"phase": Phase.PRODUCTION}),
            (production + script.production_s, "SetGamePhase", {"phase": Phase.POST_GAME}),
        ]
        for kind in dict.fromkeys(kind for _, kind, _ in steps):
            self._create(kind)
        self._steps = [(start + round(at * MICROSECONDS), kind, values) for at, kind, values in steps]

    def loop(self) -> None:
        """Send what is due."""
        while self._steps and self._clock.now_us() >= self._steps[0][0]:
            _, kind, values = self._steps.pop(0)
            self._instruct(kind, values)

    def _instruct(self, kind: str, values: dict[str, str]) -> None:
        message = self._create(kind)
        for name, value in values.items():
            field = message.DESCRIPTOR.fields_by_name[name]
            enum = field.enum_type
            setattr(message, name, value if enum is None else enum.values_by_name[value].number)
        link = self._connections.connect(HOST, self._port)
        self._connections.send(link, frame_of(message))
        self._connections.disconnect(link)
        self._connections.drain()

    def _create(self, kind: str) -> Message:
        try:
            return self._types.create(f"{PACKAGE}.{kind}")
        except ProtobufError:
            raise ProtobufError(
                f"the message definitions have no {PACKAGE}.{kind}",
                hint="they are of another version of the league, or did not compile; see the log",
            ) from None

    def close(self) -> None:
        """Leave the network."""
        self._connections.close()
