"""Writers of interfaces in place of a robot's hardware, with scripted results."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from cxbridge.space.tf import StampedTransform, Transform, TransformPublisher
from cxbridge.space.tf.geometry import Quaternion, quaternion_from_yaw
from tests.skiller.rig import Rig

NO_TURN = quaternion_from_yaw(0)


class Navigator:
    """Takes orders to drive; each order ends some loops later with the next error code of the script.

    :param name: the interface's id.
    :param errors: the error codes of successive orders; 0 after the last code.
    :param loops: the loops that an order takes.
    """

    def __init__(
        self, rig: Rig, name: str = "Navigator", errors: tuple[int, ...] = (), loops: int = 3
    ) -> None:
        board: Any = rig.board
        self.interface = board.open_for_writing("NavigatorInterface", name, owner="test")
        self.interface.final = True
        self.interface.write()
        self.orders: list[tuple[Any, ...]] = []
        self._errors: Iterator[int] = iter(errors)
        self._loops = loops
        self._left = 0
        rig.add(self)

    def loop(self) -> None:
        while (message := self.interface.msgq_first()) is not None:
            self._take(message)
            self.interface.msgq_pop()
        if self._left:
            self._left -= 1
            if not self._left:
                self.interface.error_code = next(self._errors, 0)
                self.interface.final = True
                self.interface.write()

    def _take(self, message: Any) -> None:
        kind = message.type.removesuffix("Message")
        values = [round(v, 2) if isinstance(v, float) else v for v in message.as_dict().values()]
        self.orders.append((kind, *values))
        if "Goto" in kind:
            self.interface.msgid, self.interface.final = message.id, False
            self.interface.error_code = 0
            self.interface.write()
            self._left = self._loops
        elif kind == "Stop":
            self._left = 0
            self.interface.final = True
            self.interface.write()


class Gripper:
    """Takes orders to the gripper's Arduino, and publishes the frames of the gripper in each loop.

    :param statuses: the statuses after successive orders; 0 after the last status.
    """

    def __init__(self, rig: Rig, statuses: tuple[int, ...] = ()) -> None:
        self._rig = rig
        board: Any = rig.board
        self.interface = board.open_for_writing("ArduinoInterface", "Arduino", owner="test")
        self.interface.final = True
        self.interface.write()
        self.orders: list[tuple[Any, ...]] = []
        self._statuses: Iterator[int] = iter(statuses)
        self._frames = {
            child: Frame(rig, "gripper", child)
            for child in ("gripper_z_dyn", "gripper_home", "end_effector_home")
        }
        rig.add(self)

    def loop(self) -> None:
        while (message := self.interface.msgq_first()) is not None:
            values = [round(v, 3) if isinstance(v, float) else v for v in message.as_dict().values()]
            self.orders.append((message.type.removesuffix("Message"), *values))
            self.interface.msgid, self.interface.status = message.id, next(self._statuses, 0)
            self.interface.msgq_pop()
            self.interface.write()
        for frame in self._frames.values():
            frame.put(0.01, 0.0)


class Frame:
    """A frame with a parent frame."""

    def __init__(self, rig: Rig, parent: str, name: str) -> None:
        self._clock = rig.clock
        self._names = (parent, name)
        self._publisher = TransformPublisher(rig.board, name)

    def put(self, x: float, y: float, rotation: Quaternion = NO_TURN) -> None:
        transform = Transform((x, y, 0.0), rotation)
        self._publisher.send(StampedTransform(transform, self._clock.now_us(), *self._names))


def switches(rig: Rig, *names: str) -> None:
    """Open SwitchInterfaces for writing; their messages stay unread."""
    for name in names:
        rig.board.open_for_writing("SwitchInterface", name, owner="test")


def run(rig: Rig, text: str, each_loop: Callable[[], None] = lambda: None, at_most: int = 2000) -> int:
    """Run a skill string to its end; return the number of loops."""
    rig.exec(text)
    loops = 1
    while rig.status == "S_RUNNING":
        assert loops < at_most, f"{text} does not end"
        each_loop()
        rig.loop()
        loops += 1
    return loops
