"""The machines of the workshop, and the referee: each machine has room for one piece."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random
from typing import Any

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, SkillFailedError, Steps

WOODS = ("oak", "ash")
COLOURS = ("red", "blue", "white")
POINTS = 10
"""The points for a delivery, and as many again for each coat of the piece."""
IN_TIME = 20
"""The additional points for a delivery within the window of the order."""

_PRE_GAME_S = 2.0  # time before the production begins
_CHECK_S = 1.0  # time that the referee needs to check a piece


@dataclass
class Order:
    """An order. Times are seconds since the start of the production.

    :param coats: the colours in the order of painting.
    :param announced: the time at which the referee announces the order.
    :param begin: the start of the window in which the delivery is in time; ``end`` is its end.
    """

    number: int
    wood: str
    coats: tuple[str, ...]
    announced: float
    begin: float
    end: float

    @property
    def name(self) -> str:
        """The id of the OrderInterface."""
        return f"order{self.number}"

    @property
    def piece(self) -> str:
        """The ordered piece, such as ``oak+red``."""
        return "+".join((self.wood, *self.coats))


def draw_orders(seed: int, count: int, seconds: float) -> list[Order]:
    """Draw the orders of a game, and return them in the order of their numbers.

    :param seconds: the duration of the production.
    """
    random = Random(seed)  # noqa: S311 - a game, not a secret
    orders = []
    for number in range(1, count + 1):
        coats = tuple(random.sample(COLOURS, random.randint(0, 2)))
        # all orders are announced in the first 60 % of the production
        announced = (number - 1) * seconds * 0.6 / count
        begin = announced + random.uniform(0.0, 20.0)
        end = min(seconds, begin + 60.0 + 30.0 * len(coats) + random.uniform(0.0, 30.0))
        orders.append(Order(number, random.choice(WOODS), coats, announced, begin, end))
    return orders


class Machine(SkillExecutor):
    """A machine with room for one piece, which robots put in and take out; executes ``clear{}``."""

    skills: tuple[str, ...] = ("clear",)

    def start(self) -> None:
        """Open the MachineInterface, with the state of an empty machine."""
        self.state: Any = self.board.open_for_writing("MachineInterface", self.agent, owner=self.agent)
        self.state.write()

    def close(self) -> None:
        """Close the MachineInterface."""
        self.state.close()

    def idle(self) -> None:
        """Handle the messages of robots. A full machine ignores Put, an empty machine ignores Take."""
        while (message := self.state.msgq_pop()) is not None:
            if (message.type == "PutMessage") == (not self.state.piece):
                # TakeMessage has no piece, so it empties the machine
                self.state.piece = getattr(message, "piece", "")
                self.state.robot = message.robot
                self.state.handled += 1
        self.state.write()

    def execute(self, call: SkillCall) -> Steps:
        """Execute ``clear{}``: throw the piece away, if there is one."""
        assert call.skill == "clear"
        self.state.piece = ""
        self.state.write()
        yield from ()  # makes the method a generator

    def work(self, seconds: float, text: str) -> Steps:
        """Yield the progress of work while the machine is busy."""
        self.state.busy = True
        begin_us = self.clock.now_us()
        try:
            while (share_done := (self.clock.now_us() - begin_us) / MICROSECONDS / seconds) < 1:
                self.state.write()
                yield Progress(share_done, text)
        finally:
            self.state.busy = False
            self.state.write()


class Saw(Machine):
    """Executes ``cut{wood="oak"}``; the setting ``seconds`` is the duration, by default 6."""

    skills = ("cut", "clear")
    known_settings = ("seconds",)

    def execute(self, call: SkillCall) -> Steps:
        """Cut a piece, which then is in the machine.

        :raises SkillFailedError: if a piece is in the machine already.
        """
        if call.skill == "clear":
            yield from super().execute(call)
            return
        if self.state.piece:
            raise SkillFailedError(f"{self.state.piece} is in the way")
        yield from self.work(self.setting("seconds", 6.0), f"cutting {call.text('wood')}")
        self.state.piece = call.text("wood")
        self.state.write()


class Booth(Machine):
    """Executes ``paint{colour="red"}``; the setting ``seconds`` is the duration, by default 5."""

    skills = ("paint", "clear")
    known_settings = ("seconds",)

    def execute(self, call: SkillCall) -> Steps:
        """Paint the piece in the machine.

        :raises SkillFailedError: if the machine is empty.
        """
        if call.skill == "clear":
            yield from super().execute(call)
            return
        if not self.state.piece:
            raise SkillFailedError("there is nothing to paint")
        yield from self.work(self.setting("seconds", 5.0), f"painting {call.text('colour')}")
        self.state.piece += f"+{call.text('colour')}"
        self.state.write()


class Counter(Machine):
    """The counter, with the referee behind it; executes ``hand_over{order="order2"}``.

    Settings: ``seed``, the seed of the orders, by default 1; ``orders``, their number, by default 6;
    ``minutes``, the duration of the production, by default 5.
    """

    skills = ("hand_over", "clear")
    known_settings = ("seed", "orders", "minutes")

    def start(self) -> None:
        """Draw the orders, and open the interfaces of the game and of its orders."""
        super().start()
        self._duration_s = self.setting("minutes", 5.0) * 60
        self._orders = draw_orders(self.setting("seed", 1), self.setting("orders", 6), self._duration_s)
        self._begin_us = self.clock.now_us() + int(_PRE_GAME_S * MICROSECONDS)
        game: Any = self.board.open_for_writing("GameInterface", "Game", owner="referee")
        self._game = game
        self._game.team, self._game.orders = "workshop", len(self._orders)
        self._game.write()
        self._states: list[Any] = []
        for order in self._orders:
            state = self.board.open_for_writing("OrderInterface", order.name, owner="referee")
            state.write()
            self._states.append(state)

    def close(self) -> None:
        """Close all interfaces."""
        for state in (*self._states, self._game):
            state.close()
        super().close()

    def idle(self) -> None:
        """Handle the messages of robots, and continue the game."""
        super().idle()
        self._referee()

    def execute(self, call: SkillCall) -> Steps:
        """Compare the piece with an order, and remove the piece, whether or not it is right.

        :raises SkillFailedError: if there is no such order, or the referee gives no points.
        """
        if call.skill == "clear":
            yield from super().execute(call)
            return
        name = call.text("order")
        order = next((order for order in self._orders if order.name == name), None)
        if order is None:
            raise SkillFailedError(f"there is no order '{name}'")
        for step in self.work(_CHECK_S, f"looking at {self.state.piece}"):
            self._referee()
            yield step
        piece, self.state.piece = self.state.piece, ""
        self.state.write()
        self._judge(order, piece)

    def _judge(self, order: Order, piece: str) -> None:
        """Give the points for a piece.

        :raises SkillFailedError: outside the production, if the order was delivered before, or the piece is
            wrong.
        """
        state, now_s = self._states[order.number - 1], self._production_s
        if self._game.phase != self._game.Phase.PRODUCTION:
            raise SkillFailedError(f"the game is in {self._game.phase.name}, not in production")
        if state.delivered > 0:
            raise SkillFailedError(f"{order.name} was delivered before")
        if piece != order.piece:
            raise SkillFailedError(f"{order.name} is {order.piece}, not {piece or 'nothing'}")
        punctuality = "early" if now_s < order.begin else "late" if now_s > order.end else "in time"
        state.delivered = now_s
        state.points = POINTS * (1 + len(order.coats)) + (IN_TIME if punctuality == "in time" else 0)
        state.reason = f"{order.piece} {punctuality}"
        state.write()
        self._game.deliveries += 1
        self._game.points += state.points
        self._game.write()
        self.log.info(f"{order.name} is delivered {punctuality}: {state.points} points")

    @property
    def _production_s(self) -> float:
        """The seconds since the start of the production; negative before it."""
        return (self.clock.now_us() - self._begin_us) / MICROSECONDS

    def _referee(self) -> None:
        """Announce the orders that are due. The game ends with its time, or with the last delivery."""
        now_s = self._production_s
        for order, state in zip(self._orders, self._states, strict=True):
            if now_s >= max(0.0, order.announced) and not state.number:
                state.number, state.product = order.number, order.piece
                state.begin, state.end = order.begin, order.end
                state.write()
                self.log.info(f"{order.name}: {order.piece}, from {order.begin:.0f} s to {order.end:.0f} s")
        phases = self._game.Phase
        is_over = now_s >= self._duration_s or self._game.deliveries == len(self._orders)
        phase = phases.PRE_GAME if now_s < 0 else phases.POST_GAME if is_over else phases.PRODUCTION
        if phase != self._game.phase:
            self._game.phase = phase
            self.log.info(f"the game is in {phase.name}, with {self._game.points} points")
        self._game.second = float(max(0, int(now_s)))
        self._game.write()
