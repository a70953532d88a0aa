"""The original's feature ``skill_execution``: plan actions as requests on the skill board.

Each call of a skill has a master, which requests an executor; the rules read the states of all masters once a
tick. For the protocol see docs/skill-board.md. Source: SkillExecutionFeature.cpp and
SkillExecutionMaster.cpp.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from cxbridge.errors import CxbridgeError
from cxbridge.events import Logger
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.skill_board import SkillAction, Skills
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol
from cxbridge.history.exchange import MAPPED_ACTION
from cxbridge_ros2cx.original_board import NO_AGENT
from cxbridge_ros2cx.sensing import PretendedSensing


class PretendingSkills(Skills, Protocol):
    """A skill board with dummies for actions without an executor."""

    def ask(
        self,
        skill: str,
        parameters: Mapping[str, Any],
        agent: str,
        on_change: Callable[[SkillAction], None],
        name: str = "",
    ) -> SkillAction:
        """Request the execution of a skill; see :class:`~cxbridge.executive.features.skill_board.Skills`.

        :param name: the id of the skill.
        """

    def look(self, action: SkillAction) -> None:
        """Check an action for the rules: without a response, it may time out."""

    def pretends(self, executor: str) -> bool:
        """Return whether an executor is a dummy whose effects have no sensor."""


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


class SkillExecutionFeature(Feature):
    """Defines ``call-skill-execution``, ``call-skill-read`` and ``call-skill-cancel``.

    :param name: the name of the feature in the configuration.
    :param skills: returns the skill board; None before it exists.
    :param on_removal: called when an ended skill is removed, after the rules have read its end.
    :param original: whether the original's defects are repeated.
    """

    def __init__(
        self,
        name: str,
        skills: Callable[[], PretendingSkills | None],
        on_removal: Callable[[], None] = lambda: None,
        *,
        original: bool = False,
    ) -> None:
        self.name = name
        self._skills = skills
        self._on_removal = on_removal
        self._original = original
        self._contexts: dict[str, _SkillExecutionContext] = {}

    def init_context(self, env: ClipsEnvironment) -> None:
        log = env.bus.logger("skill_execution_feature")
        context = _SkillExecutionContext(env, log, self._skills, self._on_removal, original=self._original)
        self._contexts[env.name] = context
        env.define("call-skill-execution", context.call, 5, types="*;sy;sy;sy;sy;sy")
        env.define("call-skill-read", context.read)
        env.define("call-skill-cancel", context.cancel, 1, types="*;sy")

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Cancel the environment's requests."""
        self._contexts.pop(env.name).close()


@dataclass(slots=True)
class _Call:
    """A skill of an agent.

    :param action: None if the request failed, for the reason in ``error``.
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


class _SkillExecutionContext:
    """The feature's state of one environment."""

    def __init__(
        self,
        env: ClipsEnvironment,
        log: Logger,
        skills: Callable[[], PretendingSkills | None],
        on_removal: Callable[[], None],
        *,
        original: bool,
    ) -> None:
        self._original = original
        self._env = env
        self._log = log
        self._skills = skills
        self._on_removal = on_removal
        self._sensing = PretendedSensing(env)
        self._calls: dict[str, _Call] = {}

    def call(self, skill_id: str, action: str, params: str, mapped: str, agent: str) -> None:
        """Request an executor, and cancel the agent's running skill: an agent has one at a time."""
        self._log.info(f"Requesting skill ({action}, {params}) with mapped_action {mapped} for agent {agent}")
        previous = self._calls.pop(str(agent), None)
        if previous is not None and previous.action is not None and not previous.action.is_over:
            self._log.warn(f"Previous skill {previous.skill_id} is running: cancelled")
            self._stop(previous.action)
        self._calls[str(agent)] = self._ask(str(skill_id), str(action), str(params), str(mapped), str(agent))

    def _ask(self, skill_id: str, action: str, params: str, mapped: str, agent: str) -> _Call:
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
        if not self._original:
            self._forget_feedback()
        for agent, call in sorted(self._calls.items()):
            self._look(call)
            status, error = call.state
            self._env.assert_fact(
                _FEEDBACK,
                {
                    "skill-id": Symbol(call.skill_id),
                    "agent-id": call.agent,
                    "status": Symbol(status),
                    "error": error,
                },
            )
            if status == "S_FINAL" and self._pretended(call):
                self._sensing.executed(call.skill_id)
            if status in ("S_FINAL", "S_FAILED"):
                del self._calls[agent]
                self._on_removal()

    def _forget_feedback(self) -> None:
        """Retract facts of earlier ticks, which would set a skill back to its old state.

        The rule of skills.clp for this is never defined because a parenthesis is missing.
        """
        if self._env.has_template(_FEEDBACK):
            for index, _template, _slots in list(self._env.facts(_FEEDBACK)):
                self._env.retract(index)

    def _look(self, call: _Call) -> None:
        skills = self._skills()
        if skills is not None and call.action is not None:
            skills.look(call.action)

    def _pretended(self, call: _Call) -> bool:
        skills = self._skills()
        return skills is not None and call.action is not None and skills.pretends(call.action.executor)

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
        """Cancel everything."""
        for call in self._calls.values():
            if call.action is not None and not call.action.is_over:
                self._stop(call.action)
        self._calls.clear()
