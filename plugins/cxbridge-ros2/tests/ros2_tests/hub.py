"""Both sides of a hub in one process, on nodes of this process, or on DDS."""

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
        others: {class: "CLASS", skills: [move, wave]}
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
    """Does as the last parameter says: ``fail``, ``long``, or anything else."""

    skills = ("move", "wave", "count")

    def execute(self, call: SkillCall) -> Steps:
        how = list(call.parameters.values())[-1] if call.parameters else ""
        self.log.info(f"{call.skill} {dict(call.parameters)}")
        try:
            for step in range(100_000 if how == "long" else STEPS):
                yield Progress(min(1.0, step / STEPS), f"step {step}")
        except GeneratorExit:
            self.log.info(f"{call.skill} was stopped")
            raise
        if how == "fail":
            raise SkillFailedError("door closed")
        return Progress(1.0, "there")


class Side:
    """The parts of a run: a skill board, and performers."""

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

    def ask(self, skill: str, *values: object, agent: str = "robot1", **named: object) -> Master:
        """Have a skill executed."""
        numbered = {str(number): value for number, value in enumerate(values, start=1)}
        return self.service.local_calls.ask(skill, numbered | named, agent, lambda _master: None)

    def loop(self) -> None:
        """Do the work of a run's loop."""
        self.service.loop()
        for performer in self.performers:
            performer.loop()

    def close(self) -> None:
        """End it."""
        for performer in self.performers:
            performer.close()
        self.service.close()
        self.board.shutdown()


class World:
    """Sides that loop in turns, on a virtual clock or in real time."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.sides: list[Side] = []

    def side(self, text: str, **words: str) -> Side:
        """Add a side; words in capitals are replaced in its configuration."""
        for word, value in words.items():
            text = text.replace(word, value)
        self.sides.append(Side(text, self.clock))
        return self.sides[-1]

    def loop(self, loops: int = 1) -> None:
        """Let all sides loop."""
        for _ in range(loops):
            for side in self.sides:
                side.loop()
            self.clock.sleep_until(self.clock.now_us() + LOOP_US)

    def until(self, done: Callable[[], Any], limit_s: float = 20.0) -> None:
        """Loop until it is done."""
        end_us = self.clock.now_us() + round(limit_s * 1e6)
        real_end = time.monotonic() + limit_s
        while not done():
            self.loop()
            assert self.clock.now_us() < end_us, [side.lines for side in self.sides]
            assert time.monotonic() < real_end, [side.lines for side in self.sides]

    def over(self, *masters: Master) -> list[tuple[str, str]]:
        """Loop until skills are over; return their states and errors."""
        self.until(lambda: all(master.is_over for master in masters), limit_s=60)
        return [(str(master.state), master.error) for master in masters]

    def close(self) -> None:
        """End all sides."""
        for side in self.sides:
            side.close()


class LocalWorld(World):
    """Sides whose nodes reach each other in this process, on a virtual clock."""

    def __init__(self, patch: Callable[[type, str, Any], None]) -> None:
        super().__init__(VirtualClock())
        self.graph = LocalGraph(Definitions(environment={}))
        patch(
            NodeSettings,
            "join",
            lambda _settings, name, _definitions, _report, _rights: self.graph.join(name),
        )

    def stranger(self, protocol: str, name: str = "stranger") -> Stranger:
        """Add a node that publishes the test's words."""
        return Stranger(self, protocol, name)


class Stranger:
    """Hears all words, and publishes the test's."""

    def __init__(self, world: LocalWorld, protocol: str, name: str) -> None:
        self.name = name
        self.heard: list[HubMessage] = []
        self.signs: list[Heartbeat] = []
        self.node = world.graph.join(name)
        self.world = world
        self.hub = Hub(self.node, PROTOCOLS[protocol], "", self.heard.append, self.signs.append)

    def say(self, kind: MessageKind, key: ActionKey, node: str = "", **fields: Any) -> None:
        """Say a word."""
        self.hub.publish(HubMessage(kind, node or self.name, key, **fields))

    def begin(self, key: ActionKey, node: str = "ours_move", **fields: Any) -> None:
        """Request an action, and confirm its performer."""
        self.say(MessageKind.REQUEST, key, **fields)
        assert self.hear(MessageKind.RESPONSE).key == key
        self.say(MessageKind.CONFIRM, key, node, **fields)

    def perform(self) -> ActionKey:
        """Answer a REQUEST, wait for CONFIRM, and return the action."""
        request = self.hear(MessageKind.REQUEST)
        self.say(MessageKind.RESPONSE, request.key, skill_string=request.skill_string)
        assert self.hear(MessageKind.CONFIRM, self.name).key == request.key
        return request.key

    def live(self, life: PerformerState, action: str = "move") -> None:
        """Give a sign of life."""
        self.hub.publish_heartbeat(Heartbeat(self.name, action, life), self.world.clock.now_us())

    def hear(self, kind: MessageKind, node: str = "", limit_s: float = 20.0) -> HubMessage:
        """Loop until a word comes, and return it; forget it and the words before."""

        def found() -> list[int]:
            self.node.poll()
            return [
                number
                for number, word in enumerate(self.heard)
                if word.kind == kind and node in ("", word.node)
            ]

        self.world.until(found, limit_s)
        number = found()[0]
        word = self.heard[number]
        del self.heard[: number + 1]
        return word

    def silent(self, *kinds: MessageKind, loops: int = 20) -> bool:
        """Whether none of these words comes."""
        self.world.loop(loops)
        self.node.poll()
        return not any(word.kind in kinds for word in self.heard)
