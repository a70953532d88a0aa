"""The judge of a game whose referee and machines write interfaces of the blackboard."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, InterfaceWrite
from cxbridge_explore.game.judge import PRODUCTION
from cxbridge_explore.game.score import Award, Delivery, ProductOrder, Score

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.blackboard.info import InterfaceInfo
    from cxbridge.run.agent import Run
    from cxbridge.run.team import Team

GAME_TYPE: Final = "GameInterface"
ORDER_TYPE: Final = "OrderInterface"
# The type of a machine's interface, which the scenario defines with the fields `busy` and `piece`.
MACHINE_TYPE: Final = "MachineInterface"


class BlackBoardJudge:
    """Reports the state and the score that the interfaces of a referee and of machines show.

    The event bus calls the instance with each write. Unlike a reader of an interface, a subscriber of the bus
    is invisible to the writer, so that the judge has no influence on the game.
    """

    def __init__(self, run: Run | Team) -> None:
        self.phase = ""
        self.machine_states: dict[str, str] = {}
        self.faults = ()  # no program judges: the referee is a part of the scenario
        self._run = run
        run.bus.subscribe(self, InterfaceWrite)

    def __call__(self, event: Event) -> None:
        assert isinstance(event, InterfaceWrite)
        interface_type, _, name = event.uid.partition("::")
        if interface_type == MACHINE_TYPE:
            self.machine_states[name] = _find_machine_state(event.values)
        elif interface_type == GAME_TYPE:
            self.phase = _format_enum(event.values.get("phase", ""))

    def score(self) -> Score:
        """Read the score from the first blackboard with a referee.

        :raises CxbridgeError: if no referee writes to a blackboard.
        """
        for agent in self._run.agents:
            game_infos = [info for info in agent.board.list(GAME_TYPE) if info.has_writer]
            if game_infos:
                written_orders = [info for info in agent.board.list(ORDER_TYPE) if info.has_writer]
                orders = [_read_values(agent.board, info) for info in written_orders]
                return _make_score(_read_values(agent.board, game_infos[0]), orders)
        raise CxbridgeError(f"no referee writes a {GAME_TYPE}", hint="see docs/games.md")


def _make_score(game: Mapping[str, Any], orders: Sequence[Mapping[str, Any]]) -> Score:
    """Return the score.

    :param game: the values of the referee's interface.
    :param orders: the values of each order's interface. The field ``number`` is 0 until the order is
        announced, and ``delivered`` is 0 until the order is delivered.
    """
    team, phase = str(game["team"]), _format_enum(game["phase"])
    delivered_orders = sorted(
        (order for order in orders if order["delivered"] > 0), key=itemgetter("delivered")
    )
    announced_orders = sorted((order for order in orders if order["number"]), key=itemgetter("number"))
    return Score(
        points={team: int(game["points"])},
        deliveries=tuple(
            Delivery(order["number"], order["product"], team, round(order["delivered"], 3))
            for order in delivered_orders
        ),
        awards=tuple(
            Award(
                team,
                order["points"],
                game_time=round(order["delivered"], 3),
                phase=PRODUCTION,
                reason=order["reason"],
                category=order["reason"].removeprefix(order["product"]).strip(),
            )
            for order in delivered_orders
        ),
        phase=phase,
        game_time=round(game["second"], 3),
        orders=tuple(
            ProductOrder(order["number"], order["product"], round(order["begin"], 3), round(order["end"], 3))
            for order in announced_orders
        ),
    )


def _read_values(board: BlackBoard, info: InterfaceInfo) -> dict[str, Any]:
    with board.open_for_reading(info.type, info.id) as interface:
        interface.read()
        return interface.as_dict()


def _find_machine_state(machine: Mapping[str, Any]) -> str:
    """Return the state of a machine: ``busy``, ``full`` with a finished product, or ``free``."""
    return "busy" if machine.get("busy") else "full" if machine.get("piece") else "free"


def _format_enum(value: Any) -> str:
    """Return the name of an enumeration value; a plain text is its own name."""
    return str(getattr(value, "name", value))
