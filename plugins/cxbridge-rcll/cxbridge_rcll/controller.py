"""Instructions to the referee, who plays and which phase begins: what people do with rcll-refbox-instruct."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import ProtobufError
from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge_protobuf.types import Message, MessageTypes


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

    :param cyan: the name of the team; empty: no team plays cyan.
    :param magenta: the name of the team; empty: no team plays magenta.
    :param production_s: seconds of the production; then the game is over.
    """

    cyan: str = ""
    magenta: str = ""
    production_s: float = 1200.0


class Controller(Component):
    """Instructs the referee.

    :param types: the league's messages.
    :param send: sends it a message.
    :raises ProtobufError: when a message is missing that it sends.
    """

    hooks = (Hook.SENSOR_PREPARE,)
    description = "Leads through the phases of a game"

    def __init__(
        self, context: Run, types: MessageTypes, script: Script, send: Callable[[Message], None]
    ) -> None:
        self._clock: Clock = context.clock
        self._types = types
        self._send = send
        self._begun_us: int | None = None
        teams = [("CYAN", script.cyan), ("MAGENTA", script.magenta)]
        production = BEGIN_S + SETUP_S
        self._steps: list[tuple[float, str, dict[str, str]]] = [
            (BEGIN_S, "SetTeamName", {"team_color": colour, "team_name": name})
            for colour, name in teams
            if name
        ]
        self._steps += [
            (BEGIN_S, "SetGamePhase", {"phase": Phase.SETUP}),
            (BEGIN_S, "SetGameState", {"state": "RUNNING"}),
            (production, "SetGamePhase", {"phase": Phase.PRODUCTION}),
            (production + script.production_s, "SetGamePhase", {"phase": Phase.POST_GAME}),
        ]
        for kind in dict.fromkeys(kind for _, kind, _ in self._steps):
            self._create(kind)

    def loop(self) -> None:
        """Send due messages. Time counts from the first loop: a large agent loads for seconds."""
        now_us = self._clock.now_us()
        if self._begun_us is None:
            self._begun_us = now_us
        while self._steps and now_us >= self._begun_us + round(self._steps[0][0] * MICROSECONDS):
            _, kind, values = self._steps.pop(0)
            self._send(self._instruction(kind, values))

    def _instruction(self, kind: str, values: dict[str, str]) -> Message:
        message = self._create(kind)
        for name, value in values.items():
            field = message.DESCRIPTOR.fields_by_name[name]
            enum = field.enum_type
            setattr(message, name, value if enum is None else enum.values_by_name[value].number)
        return message

    def _create(self, kind: str) -> Message:
        try:
            return self._types.create(f"{PACKAGE}.{kind}")
        except ProtobufError:
            raise ProtobufError(
                f"the message definitions have no {PACKAGE}.{kind}",
                hint="they are of another version of the league, or did not compile; see the log",
            ) from None
