"""A game as reported by a referee in another process: its state, machines and orders."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

from cxbridge.executive.host.values import Value
from cxbridge_explore.game.judge import GameState
from cxbridge_explore.game.score import POST_GAME, Award, Delivery, ProductOrder, Score
from cxbridge_protobuf.types import Message
from cxbridge_rcll.machines import BeltPosition, Workpiece
from cxbridge_rcll.score import TEAMS

_READY: Final = "READY-AT-OUTPUT"
_DELIVERED: Final = {team: f"quantity_delivered_{team.lower()}" for team in TEAMS}
_POINTS: Final = {team: f"points_{team.lower()}" for team in TEAMS}
_BASE_STATION: Final = "BS"

UNKNOWN: Final = "unknown"  # the category of all points, because the referee reports no reasons


class ReportedMachine:
    """A machine of the referee, as the robots use it.

    Its sensors ignore simulated robots. The product at the output is the one that the referee reports, until
    a robot takes it.

    :param pay: reports a base in the slide to the referee.
    """

    def __init__(self, name: str, pay: Callable[[str], None]) -> None:
        self.name = name
        self.zone = ""
        self.rotation = 0
        self.state = ""
        self._kind = ""
        self._has_product = False
        self._pay = pay

    def update(self, message: Message) -> None:
        """Process a report of the referee."""
        self._kind = message.type
        if message.HasField("zone"):
            self.zone = _enum_name(message, "zone")
            self.rotation = message.rotation
        if message.state == _READY != self.state:  # the state repeats in each report
            self._has_product = True
        self.state = message.state

    def has(self, position: BeltPosition) -> bool:
        """Return whether the position has a workpiece; a base station offers its workpiece on both sides."""
        return self._has_product and (position is BeltPosition.OUTPUT or self._kind == _BASE_STATION)

    def put(self, workpiece: Workpiece) -> None:
        """Do nothing: the referee's machine assumes a workpiece at its input."""

    def pay(self) -> None:
        self._pay(self.name)

    def take(self, position: BeltPosition) -> Workpiece | None:
        if not self.has(position):
            return None
        self._has_product = False
        return Workpiece([f"FROM-{self.name}"])


class ReportedGame:
    """A game as reported by the referee's messages.

    :param pay: reports a base in a machine's slide to the referee.
    """

    def __init__(self, pay: Callable[[str], None]) -> None:
        self.machines: dict[str, ReportedMachine] = {}
        self.phase = ""
        self.game_time = 0.0
        # Whether the referee has reported the end twice; the second report contains all points.
        self.is_over = False
        self._pay = pay
        self._points = dict.fromkeys(TEAMS, 0)
        self._awards: list[Award] = []
        self._deliveries: list[Delivery] = []
        self._orders: dict[int, ProductOrder] = {}
        self._delivered: dict[tuple[int, str], int] = {}  # the number of products by order and team

    def handle_message(self, message: Message) -> None:
        """Process a message of the referee. Ignores messages of unknown types."""
        handler = getattr(self, f"_handle_{message.DESCRIPTOR.name}", None)
        if handler is not None:
            handler(message)

    def _handle_GameState(self, message: Message) -> None:  # noqa: N802 - the name of the message
        phase = _enum_name(message, "phase")
        self.is_over = phase == self.phase == POST_GAME
        self.phase = phase
        self.game_time = _seconds(message.game_time)
        for team, field in _POINTS.items():
            points = getattr(message, field)
            if points != self._points[team]:
                difference = points - self._points[team]
                self._awards.append(Award(team, difference, self.game_time, phase, "", UNKNOWN))
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
            for team, field in _DELIVERED.items():
                count, key = getattr(order, field), (order.id, team)
                # The referee reports totals; an order may ask for several products.
                for _ in range(count - self._delivered.get(key, 0)):
                    self._deliveries.append(Delivery(order.id, complexity, team, self.game_time))
                self._delivered[key] = count

    def machine_facts(self) -> Iterator[dict[str, Value]]:
        """Yield ``name``, ``zone`` and ``rotation`` of each machine."""
        for machine in self.machines.values():
            yield {"name": machine.name, "zone": machine.zone, "rotation": machine.rotation}

    @property
    def score(self) -> Score:
        """The score. The referee does not report reasons for points."""
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
    kind = message.DESCRIPTOR.fields_by_name[field].enum_type
    return str(kind.values_by_number[getattr(message, field)].name)


def _seconds(time: Any) -> float:
    return round(float(time.sec) + float(time.nsec) / 1e9, 3)
