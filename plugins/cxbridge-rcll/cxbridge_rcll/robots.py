"""Simulated robots, which execute the skills of a team: they drive over the field and use the machines.

Robots drive straight and do not collide. Besides its drive, a skill takes a fixed time;
``drive_into_field`` also waits for the time in its parameters.
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
from cxbridge_rcll.field import Field, Pose, entry_pose
from cxbridge_rcll.machines import BeltPosition, Machine
from cxbridge_rcll.stations import StationNodes

SPEED_M_PER_S: Final = 0.5

# the assumed durations of parts of skills
ALIGN_S: Final = 4.0  # aligning with a machine after a drive
ANYWHERE_S: Final = 12.0  # a drive to an unknown location
HANDLE_S: Final = 15.0  # taking or putting a workpiece
LOOK_S: Final = 5.0  # exploring a zone, discarding a workpiece, or looking for a workpiece
ENTER_S: Final = 4.0  # driving into the field

_GENERATOR_INTERFACES: Final = ("NavGraphWithMPSGeneratorInterface", "NavGraphGeneratorInterface")
_POSE_PERIOD_S: Final = 0.5  # between two writes of the poses


@dataclass(slots=True)
class Robot:
    """A robot.

    :param has_workpiece: whether the robot's gripper has a workpiece.
    :param last_supplied_machine: the machine on which the robot last put a workpiece; empty before the first.
    """

    pose: Pose
    has_workpiece: bool = False
    last_supplied_machine: str = ""


@dataclass(slots=True)
class RobotWorld:
    """The state that all robots share.

    :param geometry: the geometry of the field.
    :param find_machine: returns a machine by name; None if there is no such machine.
    :param robots: the robots by name.
    """

    geometry: Field
    find_machine: Callable[[str], Machine | None]
    robots: dict[str, Robot] = field(default_factory=dict)

    def add_robots(self, names: Iterable[str]) -> None:
        """Add robots at the entrance of the field."""
        for number, name in enumerate(names, start=1):
            self.robots[name] = Robot(entry_pose(number))


class RobotExecutor(SkillExecutor):
    """Executes the skills of a robot; :func:`make_robot_executor` makes a subclass for each world."""

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
        self.robot.has_workpiece = False

    def _get_product_from(self, call: SkillCall) -> Steps:
        machine = self._find_machine(call.text("place"))
        yield from self._wait(HANDLE_S)
        shelf = call.get("shelf", "")
        self._take_workpiece(machine, f"SHELF-{shelf}" if shelf else str(call.get("side", "output")).upper())

    def _bring_product_to(self, call: SkillCall) -> Steps:
        machine = self._find_machine(call.text("place"))
        yield from self._wait(HANDLE_S)
        self._put_workpiece(machine, "SLIDE" if call.get("slide", False) else "CONVEYOR")

    def _manipulate_wp(self, call: SkillCall) -> Steps:
        machine = self._find_machine(call.text("mps"))
        side, target = str(call.get("side", "")), str(call.get("target", ""))
        if call.get("dry_run", False):
            yield from self._wait(LOOK_S)
            self._check_workpiece(machine, side, str(call.get("query", "THERE")))
            return
        yield from self._wait(HANDLE_S)
        if target == "WORKPIECE":
            self._take_workpiece(machine, side)
        else:
            self._put_workpiece(machine, target)

    # -- parts of skills

    def _find_machine(self, name: str) -> Machine:
        machine = self.world.find_machine(name)
        if machine is None:
            raise SkillFailedError(f"there is no machine {name}")
        return machine

    def _take_workpiece(self, machine: Machine, side: str) -> None:
        # the shelf of a cap station has an unlimited number of transparent bases with caps
        if not side.startswith("SHELF") and not machine.take_workpiece(_find_position(side)):
            raise SkillFailedError(f"there is no workpiece at {machine.name} {side}")
        self.robot.has_workpiece = True

    def _put_workpiece(self, machine: Machine, target: str) -> None:
        if not self.robot.has_workpiece:
            raise SkillFailedError("there is no workpiece in the gripper")
        self.robot.has_workpiece = False
        if target == "SLIDE":
            machine.pay_base()
        else:
            machine.put_workpiece()
            self.robot.last_supplied_machine = machine.name

    def _check_workpiece(self, machine: Machine, side: str, query: str) -> None:
        is_present = _find_position(side) in machine.belt
        if side == "INPUT" and query == "THERE":
            # the machine may have moved the workpiece that this robot has put there
            is_present |= self.robot.last_supplied_machine == machine.name
        if is_present != (query == "THERE"):
            raise SkillFailedError(f"a workpiece is {'' if is_present else 'not '}at {machine.name} {side}")

    def _drive(self, place: str) -> Steps:
        goal = self.world.geometry.find_pose(place)
        if goal is None:
            yield from self._wait(ANYWHERE_S)
            return
        start = self.robot.pose
        for fraction in self._elapsed_fractions(start.distance_m(goal) / SPEED_M_PER_S):
            x = start.x + fraction * (goal.x - start.x)
            y = start.y + fraction * (goal.y - start.y)
            self.robot.pose = Pose(x, y, math.atan2(goal.y - start.y, goal.x - start.x))
            yield None
        self.robot.pose = goal
        yield from self._wait(ALIGN_S)

    def _wait(self, seconds: float) -> Steps:
        for _ in self._elapsed_fractions(seconds):
            yield None

    def _elapsed_fractions(self, seconds: float) -> Generator[float, None, None]:
        """Yield the elapsed fraction of a duration in each loop, until its end."""
        begin_us, duration_us = self.clock.now_us(), round(seconds * MICROSECONDS)
        while (elapsed_us := self.clock.now_us() - begin_us) < duration_us:
            yield elapsed_us / duration_us


def _find_position(side: str) -> BeltPosition:
    """Return the end of the belt for the side in a skill's parameters: any side but INPUT is the output."""
    return BeltPosition.INPUT if side == "INPUT" else BeltPosition.OUTPUT


def make_robot_executor(world: RobotWorld) -> type[RobotExecutor]:
    """Return the executor class for the robots of a world, since a run takes executors as classes."""
    return type("RobotExecutor", (RobotExecutor,), {"world": world})


class RobotInterfaces(Component):
    """Writes the interfaces of the robots, except the interfaces of the Skillers.

    :param prefixes: the prefix of the interface ids by robot name. On the blackboard of the robot the prefix
        is empty; on further blackboards it is the prefix that bbsync, a plugin of Fawkes, adds to the ids.
    :param stations: adds the requested nodes to the navigation graph; None leaves the graph unchanged.
    :raises BlackBoardError: if an interface has another writer.
    """

    hooks = (Hook.SENSOR_PROCESS,)
    description = "Interfaces of the simulated robots"

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
        self._next_write_us = 0
        self._poses = {
            name: self._open("Position3DInterface", f"{prefix}Pose") for name, prefix in prefixes.items()
        }
        for name in prefixes:
            heartbeat = self._open("HeartbeatInterface", f"/heartbeat/{name}")
            heartbeat.alive = True
            heartbeat.write()
        self._served_interfaces = [
            self._open(interface_type, f"{prefix}{_generator_interface_id(interface_type)}")
            for interface_type in _GENERATOR_INTERFACES
            # the interface definitions of a team may lack a type
            if context.registry.path(interface_type) is not None
            # in Fawkes, the ids of generators begin with a slash; an agent has a generator on its own
            # blackboard, besides those of the robots
            for prefix in dict.fromkeys(("/", *(prefix or "/" for prefix in prefixes.values())))
        ]
        self._served_interfaces += [
            self._open("NavigatorInterface", f"{prefix}Navigator") for prefix in prefixes.values()
        ]

    def _open(self, interface_type: str, interface_id: str) -> Any:
        interface = self._board.open_for_writing(interface_type, interface_id, owner="Robots")
        self._interfaces.append(interface)
        return interface

    def loop(self) -> None:
        """Execute the received commands, and periodically write the robots' poses."""
        for interface in self._served_interfaces:
            self._answer_commands(interface)
        now_us = self._clock.now_us()
        if now_us < self._next_write_us:
            return
        self._next_write_us = now_us + round(_POSE_PERIOD_S * MICROSECONDS)
        for name, interface in self._poses.items():
            pose = self._world.robots[name].pose
            interface.frame = "map"
            interface.translation = (pose.x, pose.y, 0.0)
            interface.rotation = (0.0, 0.0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2))
            # in Fawkes, the number of sightings in a row: a high number means that the pose is certain
            interface.visibility_history = 100
            interface.write()

    def _answer_commands(self, interface: Any) -> None:
        """Apply the commands to the navigation graph, if there is one; report computations as done."""
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


def _generator_interface_id(interface_type: str) -> str:
    """Return the interface id that the generator plugin of Fawkes has."""
    return "navgraph-generator-mps" if "MPS" in interface_type else "navgraph-generator"
