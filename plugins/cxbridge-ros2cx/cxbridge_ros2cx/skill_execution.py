"""The feature ``skill_execution`` of ros2-clips-executive (2021), the original, on the skill board.

Each call of a skill has a master, which requests an executor; the rules read the states of all masters once a
tick. For the protocol see docs/skill-board.md. Source: SkillExecutionFeature.cpp and
SkillExecutionMaster.cpp.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cxbridge.errors import CxbridgeError
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.skill_board import SkillAction
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol, Value
from cxbridge.history.exchange import MAPPED_ACTION
from cxbridge_ros2cx.original_board import NO_AGENT

if TYPE_CHECKING:
    from cxbridge_ros2cx.skills import Ros2CxSkills


# Status for the rules by the state of the skill.
_STATUS = {
    "ASKING": "S_IDLE",
    "CONFIRMED": "S_RUNNING",
    "RUNNING": "S_RUNNING",
    "CANCELLING": "S_RUNNING",
    "SUCCEEDED": "S_FINAL",
    "FAILED": "S_FAILED",
    "CANCELLED": "S_FAILED",
}
_CANCELLED = "CANCELLED"
_FEEDBACK = "skill-feedback"
_PENDING = "domain-pending-sensed-fact"


class SkillExecutionFeature(Feature):
    """Defines ``call-skill-execution``, ``call-skill-read`` and ``call-skill-cancel``.

    :param skills: returns the skill board; None before it exists.
    :param on_removal: called when an ended skill is removed, after the rules have read its end.
    :param name: the name of the feature in the configuration.
    :param original: whether the original's defects are repeated.
    """

    def __init__(
        self,
        skills: Callable[[], Ros2CxSkills | None],
        on_removal: Callable[[], None],
        name: str,
        *,
        original: bool = False,
    ) -> None:
        self.name = name
        self._skills, self._on_removal, self._original = skills, on_removal, original
        self._users: dict[str, _SkillUser] = {}

    def init_context(self, env: ClipsEnvironment) -> None:
        user = _SkillUser(env, self._skills, self._on_removal, original=self._original)
        self._users[env.name] = user
        env.define("call-skill-execution", user.call, 5, types="*;sy;sy;sy;sy;sy")
        env.define("call-skill-read", user.read)
        env.define("call-skill-cancel", user.cancel, 1, types="*;sy")

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Cancel the environment's requests."""
        self._users.pop(env.name).close()


@dataclass(slots=True)
class _Call:
    """A skill of an agent.

    :param action: the request on the skill board; None if the request failed.
    :param error: the reason for a failed request.
    """

    skill_id: str
    agent: str
    action: SkillAction | None
    error: str = ""

    @property
    def state(self) -> tuple[str, str]:
        """Status and error for the rules."""
        if self.action is None:
            return "S_FAILED", self.error
        state = str(self.action.state)
        error = _CANCELLED if state == _CANCELLED else self.action.error
        return _STATUS[state], error if _STATUS[state] == "S_FAILED" else ""


class _SkillUser:
    """The skills that an environment has called: one for each agent."""

    def __init__(
        self,
        env: ClipsEnvironment,
        skills: Callable[[], Ros2CxSkills | None],
        on_removal: Callable[[], None],
        *,
        original: bool,
    ) -> None:
        self._env, self._skills, self._on_removal, self._original = env, skills, on_removal, original
        self._log = env.bus.logger("skill_execution_feature")
        self._sensing = PretendedSensing(env)
        self._calls: dict[str, _Call] = {}

    def call(self, skill_id: str, action: str, params: str, mapped: str, agent: str) -> None:
        """Request an executor, and cancel the agent's running skill: an agent has one at a time."""
        self._log.info(f"Requesting skill ({action}, {params}) with mapped_action {mapped} for agent {agent}")
        previous = self._calls.pop(str(agent), None)
        if previous is not None and previous.action is not None and not previous.action.is_over:
            self._log.warn(f"Previous skill {previous.skill_id} is running: cancelled")
            self._stop(previous.action)
        self._calls[str(agent)] = self._request(
            str(skill_id), str(action), str(params), str(mapped), str(agent)
        )

    def _request(self, skill_id: str, action: str, params: str, mapped: str, agent: str) -> _Call:
        skills = self._skills()
        if skills is None:
            return _Call(skill_id, agent, None, "there is no skill board")
        # the original splits at each blank, and makes one empty parameter of none
        words = params.split(" ") if self._original else params.split()
        parameters = {str(number): word for number, word in enumerate(words, start=1)}
        if mapped:
            parameters[MAPPED_ACTION] = mapped
        try:
            skill_action = skills.ask(action, parameters, agent or NO_AGENT, lambda _action: None, skill_id)
        except CxbridgeError as error:
            self._log.error(str(error))
            return _Call(skill_id, agent, None, str(error))
        return _Call(skill_id, agent, skill_action)

    def read(self) -> None:
        """Assert the state of each skill and remove the ended ones."""
        self._sensing.sense()
        if not self._original and self._env.has_template(_FEEDBACK):
            # Facts of earlier ticks would set a skill back to its old state. The rule of skills.clp that
            # retracts them is never defined because a parenthesis is missing.
            for index, _template, _slots in list(self._env.facts(_FEEDBACK)):
                self._env.retract(index)
        skills = self._skills()
        for agent, call in sorted(self._calls.items()):
            action = call.action
            if skills is not None and action is not None:
                skills.check_timeout(action)
            status, error = call.state
            slots = {"skill-id": Symbol(call.skill_id), "agent-id": call.agent}
            self._env.assert_fact(_FEEDBACK, {**slots, "status": Symbol(status), "error": error})
            pretended = skills is not None and action is not None and skills.pretends(action.executor)
            if pretended and status == "S_FINAL":
                # now: when the rules read the end, they retract the fact that connects the skill with its
                # action
                self._sensing.add(call.skill_id)
            if status in ("S_FINAL", "S_FAILED"):
                del self._calls[agent]
                self._on_removal()

    def cancel(self, agent: str) -> None:
        call = self._calls.get(str(agent))
        if call is None or call.action is None:
            self._log.error(f"Agent '{agent}' has no skill that could be cancelled")
            return
        self._stop(call.action)

    def _stop(self, action: SkillAction) -> None:
        skills = self._skills()
        if skills is not None:
            skills.stop(action.number)

    def close(self) -> None:
        """Cancel all skills."""
        for call in self._calls.values():
            if call.action is not None and not call.action.is_over:
                self._stop(call.action)
        self._calls.clear()


class PretendedSensing:
    """Simulated sensors for the effects of a dummy's actions, in one environment.

    An action with a sensed effect ends when a sensor reports the effect. The effects of dummies have no
    sensor, so they are asserted here.
    """

    def __init__(self, env: ClipsEnvironment) -> None:
        self._env = env
        # goal, plan and action of the actions that dummies have executed
        self._executed: set[tuple[Value, Value, Value]] = set()

    def add(self, skill_id: str) -> None:
        """Note that a dummy has executed a skill."""
        for _index, _template, slots in self._env.facts("skill-action-execinfo"):
            if slots["skill-id"] == skill_id:
                self._executed.add((slots["goal-id"], slots["plan-id"], slots["action-id"]))

    def sense(self) -> None:
        """Assert the pending effects of the actions that dummies have executed."""
        if not self._executed:
            return
        has_effects = self._env.has_template(_PENDING)
        effects = [slots for _, _, slots in self._env.facts(_PENDING)] if has_effects else []
        if not effects:
            # forget removed actions, so that an idle executive skips the search for their facts
            self._executed &= {
                (slots["goal-id"], slots["plan-id"], slots["id"])
                for _, _, slots in self._env.facts("plan-action")
            }
        for slots in effects:
            if (slots["goal-id"], slots["plan-id"], slots["action-id"]) in self._executed:
                self._set_fact(slots["name"], slots["param-values"], holds=slots["type"] == "POSITIVE")

    def _set_fact(self, predicate: Value, values: Value, *, holds: bool) -> None:
        indices = [
            index
            for index, _, slots in self._env.facts("domain-fact")
            if slots["name"] == predicate and slots["param-values"] == values
        ]
        if holds and not indices:
            self._env.assert_fact("domain-fact", {"name": Symbol(str(predicate)), "param-values": values})
        elif not holds:
            for index in indices:
                self._env.retract(index)
