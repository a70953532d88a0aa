"""A referee in the process of the agent: its rules and the machines under its control."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from cxbridge.config import Configuration
from cxbridge.executive.host.values import Value
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge_explore.game.judge import GameState
from cxbridge_explore.game.score import POST_GAME, Score
from cxbridge_protobuf.connections import MakeConnections
from cxbridge_protobuf.local import LOCAL_HOST, LocalNetwork
from cxbridge_protobuf.settings import NetworkSettings
from cxbridge_protobuf.types import Message, MessageTypes, make_frame
from cxbridge_rcll.controller import Controller, Script
from cxbridge_rcll.machines import Machine
from cxbridge_rcll.refbox import Refbox
from cxbridge_rcll.referee import SERVER_PORT, STATION, Referee
from cxbridge_rcll.score import phase_of, score_of, states_of


class LocalReferee:
    """A referee in this process: its rules run on the run's clock, and messages need no sockets.

    :param refbox: the checkout with the referee's rules.
    :param messages: the folder with message definitions.
    :param overlays: files that are laid over the configuration of the checkout.
    :param seed: the seed for the referee's random choices.
    """

    def __init__(self, refbox: Refbox, messages: Path, overlays: Iterable[Path], seed: int) -> None:
        self._messages = messages
        self._network = LocalNetwork()
        self._config = config = refbox.configuration(*overlays)
        for station in config.keys(STATION):
            # With `mockup`, the configured connection, the rules do not count payments.
            config.set(f"{STATION}{station}/connection", "simulated")
        self._refbox, self._seed = refbox, seed
        self._referee: Referee | None = None

    @property
    def connections(self) -> MakeConnections:
        """The factory of the agent's process-local connections."""
        return self._network.join

    def set_up(self, config: Configuration) -> None:
        """Do nothing: the agent's connections use no sockets, so the configured ports fit."""

    def components(self, script: Script) -> Iterator[Callable[[Run], Component]]:
        """Yield the factories of the referee and of its controller."""

        def referee(context: Run) -> Component:
            self._referee = Referee(
                context, self._refbox, self._config, self._messages, self._network, self._seed
            )
            return self._referee

        def controller(context: Run) -> Component:
            types = MessageTypes(context.bus.logger("Controller").warn)
            types.add_folders((self._messages,))
            connections = self._network.join(types, NetworkSettings(), context.clock.now_us)
            port = self._config.get_uint(SERVER_PORT, default=0)

            def send(message: Message) -> None:
                # A connection per message: a game needs only a few.
                link = connections.connect(LOCAL_HOST, port)
                connections.send(link, make_frame(message))
                connections.disconnect(link)
                connections.drain()

            return Controller(context, types, script, send)

        yield referee
        yield controller

    @property
    def _running(self) -> Referee:
        assert self._referee is not None  # the run is started
        return self._referee

    def machine(self, name: str) -> Machine | None:
        return self._running.machines.get(name)

    def machine_facts(self) -> Iterator[dict[str, Value]]:
        return self._running.facts("machine")

    @property
    def score(self) -> Score:
        return score_of(self._running)

    @property
    def state(self) -> GameState:
        return GameState(phase_of(self._running), states_of(self._running))

    @property
    def is_over(self) -> bool:
        return phase_of(self._running) == POST_GAME

    @property
    def faults(self) -> Sequence[str]:
        """The errors in the functions of the referee's rules."""
        return self._running.faults
