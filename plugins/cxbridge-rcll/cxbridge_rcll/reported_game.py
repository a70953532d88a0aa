"""A game as the messages of a referee box in another process report it: its state, machines and orders."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

from cxbridge.executive.host.values import Value
from cxbridge_explore.game.judge import GameState
from cxbridge_explore.game.score import POST_GAME, Award, Delivery, ProductOrder, Score
from cxbridge_protobuf.types import Message
from cxbridge_rcll.machines import BeltPosition, Workpiece
from cxbridge_rcll.score import TEAMS

_READY_STATE: Final = "READY-AT-OUTPUT"
_DELIVERED_FIELDS: Final = {team: f"quantity_delivered_{team.lower()}" for team in TEAMS}
_POINTS_FIELDS: Final = {team: f"points_{team.lower()}" for team in TEAMS}
_BASE_STATION: Final = "BS"

UNKNOWN_CATEGORY: Final = "unknown"  # the category of all points, because the referee reports no reasons


class ReportedMachine:
    """A machine of the referee box, as the robots use it.

    The referee box does not know the simulated robots. Its report decides whether there is a product at the
    output, until a robot takes the product.

    :param pay: called when a robot puts a base into the slide.
    """

    def __init__(self, name: str, pay: Callable[[str], None]) -> None:
        self.name = name
        self.zone = ""
        self.rotation = 0
        self.state = ""
        self._station_type = ""
        self._has_product = False
        self._pay = pay

    def update(self, message: Message) -> None:
        """Update the machine from a report of the referee box."""
        self._station_type = message.type
        if message.HasField("zone"):
            self.zone = _enum_name(message, "zone")
            self.rotation = message.rotation
        if message.state == _READY_STATE != self.state:
            # each report repeats the state: only a new state means a new product
            self._has_product = True
        self.state = message.state

    def has_workpiece(self, position: BeltPosition) -> bool:
        """Return whether the position has a workpiece; a base station has its workpiece on both sides."""
        return self._has_product and (position is BeltPosition.OUTPUT or self._station_type == _BASE_STATION)

    def put_workpiece(self, workpiece: Workpiece) -> None:
        """Do nothing: the machine of the referee box assumes a workpiece at its input."""

    def pay_base(self) -> None:
        self._pay(self.name)

    def take_workpiece(self, position: BeltPosition) -> Workpiece | None:
        if not self.has_workpiece(position):
            return None
        self._has_product = False
        return Workpiece([f"FROM-{self.name}"])


class ReportedGame:
    """The state of a game, updated by the messages of a referee box.

    :param pay: called with the name of a machine when a robot puts a base into its slide.
    """

    def __init__(self, pay: Callable[[str], None]) -> None:
        self.machines: dict[str, ReportedMachine] = {}
        self.phase = ""
        self.game_time = 0.0
        # true after two reports of the end, since the second report contains all points
        self.is_over = False
        self._pay = pay
        self._points = dict.fromkeys(TEAMS, 0)
        self._awards: list[Award] = []
        self._deliveries: list[Delivery] = []
        self._orders: dict[int, ProductOrder] = {}
        self._delivered_counts: dict[tuple[int, str], int] = {}  # by order and team

    def handle_message(self, message: Message) -> None:
        """Handle a message of the referee box; ignore messages of unknown types."""
        handler = getattr(self, f"_handle_{message.DESCRIPTOR.name}", None)
        if handler is not None:
            handler(message)

    def _handle_GameState(self, message: Message) -> None:  # noqa: N802 - the name of the message
        phase = _enum_name(message, "phase")
        self.is_over = phase == self.phase == POST_GAME
        self.phase = phase
        self.game_time = _seconds(message.game_time)
        for team, field in _POINTS_FIELDS.items():
            points = getattr(message, field)
            if points != self._points[team]:
                difference = points - self._points[team]
                self._awards.append(Award(team, difference, self.game_time, phase, "", UNKNOWN_CATEGORY))
                self._points[team] = points

    def _handle_MachineInfo(self, message: Message) -> None:  # noqa: N802 - the name of the message
        for report in message.machines:
            if report.name not in self.machines:
                self.machines[report.name] = ReportedMachine(report.name, self._pay)
            self.machines[report.name].update(report)

    def _handle_OrderInfo(self, message: Message) -> None:  # noqa: N802 - the name of the message
        for order in message.orders:
            complexity = _enum_name(order, "complexity")
            self._orders[order.id] = ProductOrder(
                order.id, complexity, order.delivery_period_begin, order.delivery_period_end
            )
            for team, field in _DELIVERED_FIELDS.items():
                count, key = getattr(order, field), (order.id, team)
                # the referee box reports totals; an order may be for several products
                for _ in range(count - self._delivered_counts.get(key, 0)):
                    self._deliveries.append(Delivery(order.id, complexity, team, self.game_time))
                self._delivered_counts[key] = count

    def machine_facts(self) -> Iterator[dict[str, Value]]:
        """Yield ``name``, ``zone`` and ``rotation`` of each machine."""
        for machine in self.machines.values():
            yield {"name": machine.name, "zone": machine.zone, "rotation": machine.rotation}

    @property
    def score(self) -> Score:
        """The score, without reasons for points, which the referee box does not report."""
        return Score(
            dict(self._points),
            tuple(self._deliveries),
            tuple(self._awards),
            self.phase,
            self.game_time,
            tuple(self._orders[number] for number in sorted(self._orders)),
        )

    @property
    def state(self) -> GameState:
        return GameState(self.phase, {name: machine.state for name, machine in self.machines.items()})


def _enum_name(message: Any, field: str) -> str:
    """Return the name of an enumeration field's value."""
    enum_type = message.DESCRIPTOR.fields_by_name[field].enum_type
    return str(enum_type.values_by_number[getattr(message, field)].name)


def _seconds(time: Any) -> float:
    return round(float(time.sec) + float(time.nsec) / 1e9, 3)
