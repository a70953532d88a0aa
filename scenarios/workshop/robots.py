"""The hand of a robot of the workshop."""

from __future__ import annotations

from typing import Any

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, SkillFailedError, Steps
from cxbridge.skiller.board.executor import ExecutorContext
from cxbridge.space.navgraph import load_navgraph

_REACH_M = 0.3  # greatest distance of a robot from a machine that it handles
_HANDLING_S = 2.0  # time that a robot needs to take or put a piece
_ANSWER_TIMEOUT_S = 1.0  # time in which a machine must answer


class Hand(SkillExecutor):
    """Executes ``take{machine="saw"}``, ``put{machine="booth"}`` and ``drop{}``.

    The setting ``navgraph`` names the file with the places of the machines.
    """

    skills = ("take", "put", "drop")
    known_settings = ("navgraph",)

    def __init__(self, context: ExecutorContext) -> None:
        super().__init__(context)
        self._graph = load_navgraph(self.folder / str(self.setting("navgraph")), allow_multi_graph=True)
        self._piece = ""  # the held piece; empty without a piece

    def start(self) -> None:
        """Open the pose of the robot."""
        self._pose: Any = self.board.open_for_reading("Position3DInterface", f"Pose-{self.agent}")

    def close(self) -> None:
        """Close the pose."""
        self._pose.close()

    def execute(self, call: SkillCall) -> Steps:
        """Take a piece out of a machine, put the held piece into a machine, or drop the held piece.

        :raises SkillFailedError: if the robot is not at the machine, the machine does not answer, or the hand
            or the machine is full or empty where it must not be.
        """
        if call.skill == "drop":
            self._piece = ""
            return
        name = call.text("machine")
        if not self._is_near(name):
            raise SkillFailedError(f"{self.agent} is not at the {name}")
        with self.board.open_for_reading("MachineInterface", name) as machine:
            yield from self._wait(_HANDLING_S, f"{call.skill} at the {name}")
            yield from self._take(machine, name) if call.skill == "take" else self._put(machine, name)

    def _take(self, machine: Any, name: str) -> Steps:
        """Take the piece out of a machine.

        :param machine: the open MachineInterface of the machine.
        :raises SkillFailedError: if the robot holds a piece, or the machine is empty or does not answer.
        """
        machine.read()
        if self._piece:
            raise SkillFailedError(f"{self.agent} holds {self._piece}")
        if not machine.piece:
            raise SkillFailedError(f"there is nothing in the {name}")
        piece = machine.piece
        yield from self._ask(machine, name, machine.create_message("TakeMessage", self.agent))
        self._piece = piece

    def _put(self, machine: Any, name: str) -> Steps:
        """Put the held piece into a machine.

        :raises SkillFailedError: if the robot holds no piece, or the machine is full or does not answer.
        """
        machine.read()
        if not self._piece:
            raise SkillFailedError(f"{self.agent} holds nothing")
        if machine.piece:
            raise SkillFailedError(f"{machine.piece} is in the {name}")
        yield from self._ask(machine, name, machine.create_message("PutMessage", self.agent, self._piece))
        self._piece = ""

    def _ask(self, machine: Any, name: str, message: Any) -> Steps:
        """Send a message to the machine, and wait until the machine has handled it.

        :raises SkillFailedError: if the machine does not answer in time.
        """
        handled_before = machine.handled
        machine.msgq_enqueue(message)
        begin_us = self.clock.now_us()
        while machine.handled == handled_before or machine.robot != self.agent:
            if self.clock.now_us() - begin_us > _ANSWER_TIMEOUT_S * MICROSECONDS:
                raise SkillFailedError(f"the {name} does not answer")
            yield None
            machine.read()

    def _wait(self, seconds: float, text: str) -> Steps:
        """Yield progress with the text until the seconds are over."""
        begin_us = self.clock.now_us()
        while (share_done := (self.clock.now_us() - begin_us) / MICROSECONDS / seconds) < 1:
            yield Progress(share_done, text)

    def _is_near(self, name: str) -> bool:
        node = self._graph.node(name)
        self._pose.read()
        x, y, _ = self._pose.translation
        return node is not None and node.distance(x, y) < _REACH_M
