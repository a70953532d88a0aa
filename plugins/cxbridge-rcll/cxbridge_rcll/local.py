"""A referee in the process of the agent, with the rules of a referee box and simulated machines."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from cxbridge.executive.host.values import Value
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge_explore.game.judge import GameState
from cxbridge_explore.game.score import POST_GAME, Score
from cxbridge_protobuf.connections import MakeConnections
from cxbridge_protobuf.local import LOCAL_HOST, LocalNetwork
from cxbridge_protobuf.types import Message, MessageTypes, make_frame
from cxbridge_rcll.controller import Controller
from cxbridge_rcll.machines import Machine
from cxbridge_rcll.refbox import Refbox
from cxbridge_rcll.referee import SERVER_PORT_PATH, STATIONS_PATH, Referee
from cxbridge_rcll.score import read_machine_states, read_phase, read_score


class LocalReferee:
    """A referee in this process: its rules run on the run's clock, and messages need no sockets.

    :param refbox: the checkout with the referee's rules.
    :param message_folder: the folder with message definitions.
    :param overlays: files that are laid over the configuration of the checkout.
    :param seed: the seed for the referee's random choices.
    """

    def __init__(self, refbox: Refbox, message_folder: Path, overlays: Iterable[Path], seed: int) -> None:
        self._message_folder = message_folder
        self._network = LocalNetwork()
        self._config = config = refbox.load_configuration(*overlays)
        for station in config.keys(STATIONS_PATH):
            # instead of the configured `mockup`, with which the rules do not count the bases in the slides
            config.set(f"{STATIONS_PATH}{station}/connection", "simulated")
        self._refbox, self._seed = refbox, seed
        self._referee: Referee | None = None

    @property
    def make_connections(self) -> MakeConnections:
        """The factory of the agent's process-local connections."""
        return self._network.join

    def component_factories(
        self, team_name: str, production_s: float
    ) -> Iterator[Callable[[Run], Component]]:
        """Yield the factories of the referee and of its controller.

        :param team_name: the name of the team that plays as cyan.
        :param production_s: the seconds of the production phase, after which the game is over.
        """

        def make_referee(context: Run) -> Component:
            self._referee = Referee(
                context, self._refbox, self._config, self._message_folder, self._network, self._seed
            )
            return self._referee

        def make_controller(context: Run) -> Component:
            types = MessageTypes(context.bus.logger("Controller").warn)
            types.add_folders((self._message_folder,))
            connections = self._network.join(types, context.clock.now_us)
            port = self._config.get_uint(SERVER_PORT_PATH, default=0)

            def send(message: Message) -> None:
                # a connection for each message, since a game needs only a few messages
                link = connections.connect(LOCAL_HOST, port)
                connections.send(link, make_frame(message))
                connections.disconnect(link)
                connections.drain()

            return Controller(context, types, team_name, production_s, send)

        yield make_referee
        yield make_controller

    @property
    def _running_referee(self) -> Referee:
        assert self._referee is not None  # the run has made its components before the first use
        return self._referee

    def find_machine(self, name: str) -> Machine | None:
        return self._running_referee.machines.get(name)

    def machine_facts(self) -> Iterator[dict[str, Value]]:
        return self._running_referee.facts("machine")

    @property
    def score(self) -> Score:
        return read_score(self._running_referee)

    @property
    def state(self) -> GameState:
        return GameState(read_phase(self._running_referee), read_machine_states(self._running_referee))

    @property
    def is_over(self) -> bool:
        return read_phase(self._running_referee) == POST_GAME

    @property
    def faults(self) -> Sequence[str]:
        """The errors in the functions of the referee's rules."""
        return self._running_referee.faults
