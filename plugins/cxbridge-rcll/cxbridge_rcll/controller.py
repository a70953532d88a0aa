"""Instructs the referee about teams and phases, as people do with the program rcll-refbox-instruct."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.errors import ProtobufError
from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge_explore.game.judge import PRODUCTION
from cxbridge_explore.game.score import POST_GAME
from cxbridge_protobuf.types import Message, MessageTypes

MESSAGE_PACKAGE: Final = "llsf_msgs"  # the protobuf package of the league's messages

PRE_GAME_S: Final = 5.0  # the time before the setup phase, in which the agent opens its connections

# The duration of the setup phase, shorter than the league's 300 s, in which people carry robots to the field.
SETUP_S: Final = 15.0


class Controller(Component):
    """Instructs the referee.

    :param types: the message types of the league.
    :param team_name: the name of the team that plays as cyan.
    :param production_s: the seconds of the production phase.
    :param send: sends a message to the referee.
    :raises ProtobufError: if the definition of a needed message is missing.
    """

    hooks = (Hook.SENSOR_PREPARE,)
    description = "Leads the referee through the phases of a game"

    def __init__(
        self,
        context: Run,
        types: MessageTypes,
        team_name: str,
        production_s: float,
        send: Callable[[Message], None],
    ) -> None:
        self._clock: Clock = context.clock
        self._types = types
        self._send = send
        self._begin_us: int | None = None
        production_begin_s = PRE_GAME_S + SETUP_S
        # the time after the first loop in seconds, the type of the message, and the values of its fields
        self._steps: list[tuple[float, str, dict[str, str]]] = [
            (PRE_GAME_S, "SetTeamName", {"team_color": "CYAN", "team_name": team_name}),
            (PRE_GAME_S, "SetGamePhase", {"phase": "SETUP"}),
            (PRE_GAME_S, "SetGameState", {"state": "RUNNING"}),
            (production_begin_s, "SetGamePhase", {"phase": PRODUCTION}),
            (production_begin_s + production_s, "SetGamePhase", {"phase": POST_GAME}),
        ]
        # a missing definition is an error here, not in the middle of a game
        for message_type in dict.fromkeys(message_type for _, message_type, _ in self._steps):
            self._create_message(message_type)

    def loop(self) -> None:
        """Send the messages that are due.

        The time counts from the first loop, since a large agent loads for seconds.
        """
        now_us = self._clock.now_us()
        if self._begin_us is None:
            self._begin_us = now_us
        while self._steps:
            due_s, message_type, field_values = self._steps[0]
            if now_us < self._begin_us + round(due_s * MICROSECONDS):
                break
            del self._steps[0]
            self._send(self._make_instruction(message_type, field_values))

    def _make_instruction(self, message_type: str, field_values: dict[str, str]) -> Message:
        message = self._create_message(message_type)
        for name, value in field_values.items():
            field = message.DESCRIPTOR.fields_by_name[name]
            enum = field.enum_type
            setattr(message, name, value if enum is None else enum.values_by_name[value].number)
        return message

    def _create_message(self, message_type: str) -> Message:
        try:
            return self._types.create(f"{MESSAGE_PACKAGE}.{message_type}")
        except ProtobufError:
            raise ProtobufError(
                f"the message definitions have no {MESSAGE_PACKAGE}.{message_type}",
                hint="they belong to another version of the league, or did not compile; see the log",
            ) from None
