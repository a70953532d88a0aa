"""Both sides of a hub, on nodes of this process or on DDS."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import Clock, VirtualClock
from cxbridge.config import Configuration
from cxbridge.events import EventBus, LogLine
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.rights import ALL_RIGHTS
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, SkillFailedError, Steps
from cxbridge.skiller.board.master import Master
from cxbridge.skiller.board.service import SkillBoardService
from cxbridge.skiller.board.settings import BoardSettings
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.hub.hub import Hub
from cxbridge_ros2.hub.performer import HubPerformer
from cxbridge_ros2.hub.protocol import ActionKey, Heartbeat, HubMessage, MessageKind, PerformerState
from cxbridge_ros2.hub.settings import PROTOCOLS, read_performer_settings
from cxbridge_ros2.settings import NodeSettings
from cxbridge_ros2.transports.local import LocalGraph

LOOP_US = 20_000
STEPS = 30
CALLERS = {
    "plansys2": "cxbridge_ros2.plansys2:PlanSys2Skills",
    "skill-execution": "cxbridge_ros2.skill_execution:SkillExecutionSkills",
}
CALLER = """
skill-board:
  agents:
    robot1:
      executors:
        hub: {class: "CLASS", skills: [move, wave]}
"""
PERFORMER = """
skill-board:
  agents:
    robot2:
      executors:
        work: {class: "ros2_tests.hub:Work"}
ros2:
  performers:
    hub: {protocol: PROTOCOL, name: ours, actions: [move, wave]}
"""


class Work(SkillExecutor):
    """An executor whose last parameter selects the end: ``fail``, ``long``, or success."""

    skills = ("move", "wave", "count")

    def execute(self, call: SkillCall) -> Steps:
        mode = list(call.parameters.values())[-1] if call.parameters else ""
        self.log.info(f"{call.skill} {dict(call.parameters)}")
        try:
            for step in range(100_000 if mode == "long" else STEPS):
                yield Progress(min(1.0, step / STEPS), f"step {step}")
        except GeneratorExit:
            self.log.info(f"{call.skill} was stopped")
            raise
        if mode == "fail":
            raise SkillFailedError("door closed")
        return Progress(1.0, "arrived")


class Side:
    """One side of a hub: a skill board and performers."""

    def __init__(self, text: str, clock: Clock) -> None:
        self.clock = clock
        self.bus = EventBus(clock)
        self.lines: list[str] = []
        self.bus.subscribe(self._note, LogLine)
        config = Configuration.from_text(text, "scenario.yaml")
        self.board = LocalBlackBoard(InterfaceRegistry(), clock, self.bus)
        settings = BoardSettings.from_config(config, Path())
        assert settings is not None
        self.service = SkillBoardService(self.board, clock, self.bus, settings)
        self.performers: list[HubPerformer] = []
        for each in read_performer_settings(
            config, [agent.name for agent in settings.agents], Path()
        ).values():
            log = self.bus.logger("performer")
            performer = HubPerformer(each, lambda: self.service.local_calls, ALL_RIGHTS, clock, log)
            self.performers.append(performer)

    def _note(self, event: Any) -> None:
        self.lines.append(event.text)

    def request_skill(self, skill: str, *values: object, agent: str = "robot1", **named: object) -> Master:
        """Request the execution of a skill."""
        numbered = {str(number): value for number, value in enumerate(values, start=1)}
        return self.service.local_calls.request(skill, numbered | named, agent, lambda _master: None)

    def loop(self) -> None:
        """Run the loops of the board and the performers once."""
        self.service.loop()
        for performer in self.performers:
            performer.loop()

    def close(self) -> None:
        """Close the performers and the board."""
        for performer in self.performers:
            performer.close()
        self.service.close()
        self.board.shutdown()


class World:
    """Sides that loop in turns, on a virtual clock or in real time."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.sides: list[Side] = []

    def add_side(self, text: str, **words: str) -> Side:
        """Add a side; ``words`` replace words in capitals in the configuration."""
        for word, value in words.items():
            text = text.replace(word, value)
        self.sides.append(Side(text, self.clock))
        return self.sides[-1]

    def loop(self, loops: int = 1) -> None:
        """Run the loops of all sides."""
        for _ in range(loops):
            for each in self.sides:
                each.loop()
            self.clock.sleep_until(self.clock.now_us() + LOOP_US)

    def wait_until(self, condition: Callable[[], Any], limit_s: float = 20.0) -> None:
        """Loop until a condition is true."""
        end_us = self.clock.now_us() + round(limit_s * 1e6)
        real_end = time.monotonic() + limit_s
        while not condition():
            self.loop()
            assert self.clock.now_us() < end_us, [each.lines for each in self.sides]
            assert time.monotonic() < real_end, [each.lines for each in self.sides]

    def wait_for_ends(self, *masters: Master) -> list[tuple[str, str]]:
        """Loop until skills are over, and return their states and errors."""
        self.wait_until(lambda: all(master.is_over for master in masters), limit_s=60)
        return [(str(master.state), master.error) for master in masters]

    def close(self) -> None:
        """Close all sides."""
        for each in self.sides:
            each.close()


class LocalWorld(World):
    """Sides whose nodes share a graph in this process, on a virtual clock."""

    def __init__(self, patch: Callable[[type, str, Any], None]) -> None:
        super().__init__(VirtualClock())
        self.graph = LocalGraph(Definitions(environment={}))
        patch(
            NodeSettings,
            "join",
            lambda _settings, name, _definitions, _report, _rights: self.graph.join(name),
        )

    def add_peer(self, protocol: str, name: str = "peer") -> HubPeer:
        """Add a node that publishes messages of the test."""
        return HubPeer(self, protocol, name)


class HubPeer:
    """A node that receives all messages of a hub, and publishes messages of a test."""

    def __init__(self, world: LocalWorld, protocol: str, name: str) -> None:
        self.name = name
        self.messages: list[HubMessage] = []
        self.heartbeats: list[Heartbeat] = []
        self.node = world.graph.join(name)
        self.world = world
        self.hub = Hub(self.node, PROTOCOLS[protocol], "", self.messages.append, self.heartbeats.append)

    def send(self, kind: MessageKind, key: ActionKey, node: str = "", **fields: Any) -> None:
        """Publish a message."""
        self.hub.publish(HubMessage(kind, node or self.name, key, **fields))

    def request_and_confirm(self, key: ActionKey, node: str = "ours_move", **fields: Any) -> None:
        """Request an action, and confirm the performer."""
        self.send(MessageKind.REQUEST, key, **fields)
        assert self.receive(MessageKind.RESPONSE).key == key
        self.send(MessageKind.CONFIRM, key, node, **fields)

    def accept_request(self) -> ActionKey:
        """Answer a REQUEST, wait for the CONFIRM, and return the action."""
        request = self.receive(MessageKind.REQUEST)
        self.send(MessageKind.RESPONSE, request.key, skill_string=request.skill_string)
        assert self.receive(MessageKind.CONFIRM, self.name).key == request.key
        return request.key

    def send_heartbeat(self, state: PerformerState, action: str = "move") -> None:
        """Publish a heartbeat."""
        self.hub.publish_heartbeat(Heartbeat(self.name, action, state), self.world.clock.now_us())

    def receive(self, kind: MessageKind, node: str = "", limit_s: float = 20.0) -> HubMessage:
        """Loop until a message arrives, and return the message; drop this and all earlier messages."""

        def find_numbers() -> list[int]:
            self.node.poll()
            return [
                number
                for number, message in enumerate(self.messages)
                if message.kind == kind and node in ("", message.node)
            ]

        self.world.wait_until(find_numbers, limit_s)
        number = find_numbers()[0]
        message = self.messages[number]
        del self.messages[: number + 1]
        return message

    def receives_none(self, *kinds: MessageKind, loops: int = 20) -> bool:
        """Whether no message of the kinds arrives."""
        self.world.loop(loops)
        self.node.poll()
        return not any(message.kind in kinds for message in self.messages)
