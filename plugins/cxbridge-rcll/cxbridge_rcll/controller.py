"""Instructions to the referee about teams and phases, normally given by people with rcll-refbox-instruct."""

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
    PRE_GAME = "PRE_GAME"
    SETUP = "SETUP"
    EXPLORATION = "EXPLORATION"
    PRODUCTION = "PRODUCTION"
    POST_GAME = "POST_GAME"


PACKAGE: Final = "llsf_msgs"  # the protobuf package of the league's messages

BEGIN_S: Final = 5.0  # the seconds before the setup phase, in which the agent starts to listen

# The seconds of the setup phase. The league's 300 s only serve to carry robots to their places.
SETUP_S: Final = 15.0


@dataclass(frozen=True, slots=True)
class Script:
    """The timeline of a game.

    :param cyan: the name of team cyan; empty if absent.
    :param magenta: the name of team magenta; empty if absent.
    :param production_s: the seconds of the production phase, after which the game is over.
    """

    cyan: str = ""
    magenta: str = ""
    production_s: float = 1200.0


class Controller(Component):
    """Instructs the referee.

    :param types: the message types of the league.
    :param send: sends a message to the referee.
    :raises ProtobufError: if the definition of a needed message is missing.
    """

    hooks = (Hook.SENSOR_PREPARE,)
    description = "Leads through the phases of a game"

    def __init__(
        self, context: Run, types: MessageTypes, script: Script, send: Callable[[Message], None]
    ) -> None:
        self._clock: Clock = context.clock
        self._types = types
        self._send = send
        self._begin_us: int | None = None
        teams = [("CYAN", script.cyan), ("MAGENTA", script.magenta)]
        production_begin_s = BEGIN_S + SETUP_S
        # The seconds after the first loop, the type of the message, and its fields.
        self._steps: list[tuple[float, str, dict[str, str]]] = [
            (BEGIN_S, "SetTeamName", {"team_color": colour, "team_name": name})
            for colour, name in teams
            if name
        ]
        self._steps += [
            (BEGIN_S, "SetGamePhase", {"phase": Phase.SETUP}),
            (BEGIN_S, "SetGameState", {"state": "RUNNING"}),
            (production_begin_s, "SetGamePhase", {"phase": Phase.PRODUCTION}),
            (production_begin_s + script.production_s, "SetGamePhase", {"phase": Phase.POST_GAME}),
        ]
        # A missing definition fails here, not in the middle of a game.
        for kind in dict.fromkeys(kind for _, kind, _ in self._steps):
            self._create(kind)

    def loop(self) -> None:
        """Send the due messages.

        Time counts from the first loop, since a large agent loads for seconds.
        """
        now_us = self._clock.now_us()
        if self._begin_us is None:
            self._begin_us = now_us
        while self._steps:
            due_s, kind, values = self._steps[0]
            if now_us < self._begin_us + round(due_s * MICROSECONDS):
                break
            del self._steps[0]
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
