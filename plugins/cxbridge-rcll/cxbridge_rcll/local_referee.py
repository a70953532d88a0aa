"""A referee in the process of the agent, with the rules of a referee box and simulated machines."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge_explore.game.score import Score
from cxbridge_protobuf.connections import MakeConnections
from cxbridge_protobuf.local_connections import LOCAL_HOST, LocalNetwork
from cxbridge_protobuf.types import Message, MessageTypes, make_frame
from cxbridge_rcll.controller import Controller
from cxbridge_rcll.refbox import Refbox
from cxbridge_rcll.referee import SERVER_PORT_PATH, STATIONS_PATH, Referee
from cxbridge_rcll.score import read_phase, read_score


class LocalReferee:
    """A referee in this process: its rules run on the run's clock, and messages need no sockets.

    The class implements :class:`~cxbridge_explore.game.judge.Judge`.

    :param refbox: the checkout with the referee's rules.
    :param message_folder: the folder with message definitions.
    :param overlays: files that are laid over the configuration of the checkout.
    :param seed: the seed for the referee's random choices.
    :ivar component: the referee as a component of the run; set when the run makes its components.
    """

    component: Referee

    def __init__(self, refbox: Refbox, message_folder: Path, overlays: Iterable[Path], seed: int) -> None:
        self._message_folder = message_folder
        self._network = LocalNetwork()
        self._config = config = refbox.load_configuration(*overlays)
        for station in config.keys(STATIONS_PATH):
            # instead of the configured `mockup`, with which the rules assume that missing bases were paid
            config.set(f"{STATIONS_PATH}{station}/connection", "simulated")
        self._refbox, self._seed = refbox, seed

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
            self.component = Referee(
                context, self._refbox, self._config, self._message_folder, self._network, self._seed
            )
            return self.component

        def make_controller(context: Run) -> Component:
            types = MessageTypes(context.bus.logger("Controller").warn)
            types.add_folders((self._message_folder,))
            connections = self._network.join(types, context.clock.now_us)
            port = self._config.get_uint(SERVER_PORT_PATH, default=0)

            def send(message: Message) -> None:
                # a connection for each message, since a game needs only a few messages
                link_id = connections.connect(LOCAL_HOST, port)
                connections.send(link_id, make_frame(message))
                connections.disconnect(link_id)
                connections.drain()  # the events of this end are unused, and would pile up

            return Controller(context, types, team_name, production_s, send)

        yield make_referee
        yield make_controller

    @property
    def phase(self) -> str:
        return read_phase(self.component.env)

    @property
    def machine_states(self) -> dict[str, str]:
        rows = self.component.env.columns("machine", "name", "state")
        return {str(name): str(state) for name, state in rows}

    @property
    def faults(self) -> Sequence[str]:
        """The errors in the functions of the referee's rules."""
        return self.component.env.faults

    def score(self) -> Score:
        return read_score(self.component.env)
