"""The robots: executors of the team's skills that move over the field and use the machines.

They drive straight and do not collide. Each skill takes a fixed time besides its drive.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.skiller.board.executor import SkillExecutor, SkillFailedError, Steps
from cxbridge.skiller.board.protocol import SkillCall
from cxbridge_rcll.field import Field, Pose, entry
from cxbridge_rcll.machines import BeltPosition, Workpiece, Workplace
from cxbridge_rcll.stations import StationNodes

SPEED: Final = 0.5  # the speed of a robot, in metres per second

ALIGN_S: Final = 4.0  # seconds to align with a machine after a drive

ANYWHERE_S: Final = 12.0  # seconds for a drive to an unknown place

HANDLE_S: Final = 15.0  # seconds to take or put a workpiece

LOOK_S: Final = 5.0  # seconds to explore a zone, discard a workpiece or check for one
ENTER_S: Final = 4.0  # seconds to drive into the field

_GENERATORS: Final = ("NavGraphWithMPSGeneratorInterface", "NavGraphGeneratorInterface")
_POSE_S: Final = 0.5  # seconds between two writes of the poses


@dataclass(slots=True)
class Robot:
    """A robot.

    :param number: the number of the robot, from 1.
    :param workpiece: the workpiece in the robot's gripper.
    :param last_put: the machine on which the robot last put a workpiece; empty before.
    """

    name: str
    number: int
    pose: Pose
    workpiece: Workpiece | None = None
    last_put: str = ""


@dataclass(slots=True)
class RobotWorld:
    """The state that all robots share.

    :param places: the geometry of the field.
    :param machine: returns a machine by name.
    """

    places: Field
    machine: Callable[[str], Workplace | None]
    robots: dict[str, Robot] = field(default_factory=dict)

    def add(self, names: Iterable[str]) -> None:
        """Add robots, with their start poses at the entrance of the field."""
        for number, name in enumerate(names, start=1):
            self.robots[name] = Robot(name, number, entry(number))


class RobotExecutor(SkillExecutor):
    """Executes the skills of a robot; :func:`robot_executor` creates a subclass per world."""

    skills = (
        "moveto",
        "drive_into_field",
        "manipulate_wp",
        "discard",
        "explore_zone",
        "moveto_corner_turn",
        "get_product_from",
        "bring_product_to",
    )
    world: RobotWorld

    def start(self) -> None:
        self.robot = self.world.robots[self.agent]

    def execute(self, call: SkillCall) -> Steps:
        steps: Callable[[SkillCall], Steps] = getattr(self, f"_{call.skill}")
        return steps(call)

    # -- skills

    def _moveto(self, call: SkillCall) -> Steps:
        yield from self._drive(str(call.get("place", "")))

    _moveto_corner_turn = _moveto

    def _explore_zone(self, call: SkillCall) -> Steps:
        yield from self._drive(str(call.get("zone", "")))
        yield from self._wait(LOOK_S)

    def _drive_into_field(self, call: SkillCall) -> Steps:
        yield from self._wait(call.number("wait", 0.0) + ENTER_S)

    def _discard(self, _call: SkillCall) -> Steps:
        yield from self._wait(LOOK_S)
        self.robot.workpiece = None

    def _get_product_from(self, call: SkillCall) -> Steps:
        machine = self._machine(call.text("place"))
        yield from self._wait(HANDLE_S)
        shelf = call.get("shelf", "")
        self._take(machine, f"SHELF-{shelf}" if shelf else str(call.get("side", "output")).upper())

    def _bring_product_to(self, call: SkillCall) -> Steps:
        machine = self._machine(call.text("place"))
        yield from self._wait(HANDLE_S)
        self._put(machine, "SLIDE" if call.get("slide", False) else "CONVEYOR")

    def _manipulate_wp(self, call: SkillCall) -> Steps:
        machine = self._machine(call.text("mps"))
        side, target = str(call.get("side", "")), str(call.get("target", ""))
        if call.get("dry_run", False):
            yield from self._wait(LOOK_S)
            self._check(machine, side, str(call.get("query", "THERE")))
            return
        yield from self._wait(HANDLE_S)
        if target == "WORKPIECE":
            self._take(machine, side)
        else:
            self._put(machine, target)

    # -- parts of skills

    def _machine(self, name: str) -> Workplace:
        machine = self.world.machine(name)
        if machine is None:
            raise SkillFailedError(f"there is no machine {name}")
        return machine

    def _take(self, machine: Workplace, side: str) -> None:
        if side.startswith("SHELF"):
            # The shelf of a cap station never runs out of transparent bases with caps.
            self.robot.workpiece = Workpiece(["BASE_CLEAR", "CAP"])
            return
        workpiece = machine.take(BeltPosition.INPUT if side == "INPUT" else BeltPosition.OUTPUT)
        if workpiece is None:
            raise SkillFailedError(f"there is no workpiece at {machine.name} {side}")
        self.robot.workpiece = workpiece

    def _put(self, machine: Workplace, target: str) -> None:
        workpiece, self.robot.workpiece = self.robot.workpiece, None
        if workpiece is None:
            raise SkillFailedError("there is no workpiece in the gripper")
        if target == "SLIDE":
            machine.pay()
        else:
            machine.put(workpiece)
            self.robot.last_put = machine.name

    def _check(self, machine: Workplace, side: str, query: str) -> None:
        is_present = machine.has(BeltPosition.INPUT if side == "INPUT" else BeltPosition.OUTPUT)
        if side == "INPUT" and query == "THERE":
            # The machine may have moved the robot's workpiece already.
            is_present |= self.robot.last_put == machine.name
        if is_present != (query == "THERE"):
            raise SkillFailedError(f"a workpiece is {'' if is_present else 'not '}at {machine.name} {side}")

    def _drive(self, place: str) -> Steps:
        goal = self.world.places.find(place)
        if goal is None:
            yield from self._wait(ANYWHERE_S)
            return
        start = self.robot.pose
        for fraction in self._fractions(start.distance(goal) / SPEED):
            x = start.x + fraction * (goal.x - start.x)
            y = start.y + fraction * (goal.y - start.y)
            self.robot.pose = Pose(x, y, math.atan2(goal.y - start.y, goal.x - start.x))
            yield None
        self.robot.pose = goal
        yield from self._wait(ALIGN_S)

    def _wait(self, seconds: float) -> Steps:
        for _ in self._fractions(seconds):
            yield None

    def _fractions(self, seconds: float) -> Generator[float, None, None]:
        """Yield the elapsed fraction of a time span until its end."""
        begin_us, length_us = self.clock.now_us(), round(seconds * MICROSECONDS)
        while (elapsed_us := self.clock.now_us() - begin_us) < length_us:
            yield elapsed_us / length_us


def robot_executor(world: RobotWorld) -> type[RobotExecutor]:
    """Return the executor class for the robots of a world; a run takes executors as classes."""
    return type("RobotExecutor", (RobotExecutor,), {"world": world})


class RobotInterfaces(Component):
    """Writes the robots' interfaces other than skills.

    :param prefixes: the prefix of the interface ids by robot name: that of Fawkes' bbsync on another robot's
        blackboard, empty on the robot's own.
    :param stations: gets the messages to the generator of the navigation graph; None to ignore them.
    :raises BlackBoardError: if an interface has another writer.
    """

    hooks = (Hook.SENSOR_PROCESS,)
    description = "What robots tell over the blackboard"

    def __init__(
        self,
        context: Run,
        world: RobotWorld,
        prefixes: Mapping[str, str],
        stations: StationNodes | None = None,
    ) -> None:
        self._stations = stations
        self._board, self._clock, self._world = context.board, context.clock, world
        self._interfaces: list[Any] = []
        self._next_us = 0
        try:
            self._poses = {
                name: self._open("Position3DInterface", f"{prefix}Pose") for name, prefix in prefixes.items()
            }
            for name in prefixes:
                alive = self._open("HeartbeatInterface", f"/heartbeat/{name}")
                alive.alive = True
                alive.write()
            self._served_interfaces = [
                self._open(kind, f"{prefix}{_id_of(kind)}")
                for kind in _GENERATORS
                if context.registry.path(kind) is not None  # a team may lack this interface
                for prefix in dict.fromkeys(("/", *(prefix or "/" for prefix in prefixes.values())))
            ]
            self._served_interfaces += [
                self._open("NavigatorInterface", f"{prefix}Navigator") for prefix in prefixes.values()
            ]
        except Exception:
            self.close()
            raise

    def _open(self, kind: str, name: str) -> Any:
        interface = self._board.open_for_writing(kind, name, owner="Robots")
        self._interfaces.append(interface)
        return interface

    def loop(self) -> None:
        """Answer commands, and periodically write the robots' poses."""
        for interface in self._served_interfaces:
            self._answer_commands(interface)
        now_us = self._clock.now_us()
        if now_us < self._next_us:
            return
        self._next_us = now_us + round(_POSE_S * MICROSECONDS)
        for name, interface in self._poses.items():
            pose = self._world.robots[name].pose
            interface.frame = "map"
            interface.translation = (pose.x, pose.y, 0.0)
            interface.rotation = (0.0, 0.0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2))
            interface.visibility_history = 100  # Fawkes' count of sightings: the pose is certain
            interface.write()

    def _answer_commands(self, interface: Any) -> None:
        """Report each command as done."""
        while (message := interface.msgq_pop()) is not None:
            if self._stations is not None:
                self._stations.handle(message)
            if message.type == "ComputeMessage":
                interface.msgid = message.id
                interface.final = True
                interface.write()

    def close(self) -> None:
        for interface in reversed(self._interfaces):
            self._board.close(interface)
        self._interfaces.clear()


def _id_of(kind: str) -> str:
    """Return the id of a generator's interface, as Fawkes' plugins have it."""
    return "navgraph-generator-mps" if "MPS" in kind else "navgraph-generator"
