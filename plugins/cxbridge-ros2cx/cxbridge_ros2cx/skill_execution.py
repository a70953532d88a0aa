"""The feature ``skill_execution`` of the thesis' executive, on the skill board.

In the thesis' executive, ros2-clips-executive (2021), each call of a skill has a master, which requests an
executor for the skill. The rules read the states of all masters once per tick. docs/skill-board.md describes
the protocol. Sources: SkillExecutionFeature.cpp, SkillExecutionMaster.cpp.
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
from cxbridge_ros2cx.thesis_board import NO_AGENT

if TYPE_CHECKING:
    from cxbridge_ros2cx.skill_board_client import SkillBoardClient

# the status in facts `skill-feedback`, by the state of the skill on the board
_STATUS_BY_STATE = {
    "ASKING": "S_IDLE",
    "CONFIRMED": "S_RUNNING",
    "RUNNING": "S_RUNNING",
    "CANCELLING": "S_RUNNING",
    "SUCCEEDED": "S_FINAL",
    "FAILED": "S_FAILED",
    "CANCELLED": "S_FAILED",
}
_CANCELLED = "CANCELLED"
_FEEDBACK_TEMPLATE = "skill-feedback"
_PENDING_EFFECT_TEMPLATE = "domain-pending-sensed-fact"


class SkillExecutionFeature(Feature):
    """Defines ``call-skill-execution``, ``call-skill-read`` and ``call-skill-cancel``.

    :param get_skill_board: returns the skill board; None before the skill board exists.
    :param on_skill_removed: called when an ended skill is removed: in the tick that asserts its end.
    :param repeats_defects: whether to repeat the defects of the thesis' executive.
    """

    name = "skill_execution"

    def __init__(
        self,
        get_skill_board: Callable[[], SkillBoardClient | None],
        on_skill_removed: Callable[[], None],
        *,
        repeats_defects: bool = False,
    ) -> None:
        self.get_skill_board, self.on_skill_removed, self.repeats_defects = (
            get_skill_board,
            on_skill_removed,
            repeats_defects,
        )
        self._skills_by_environment: dict[str, _EnvironmentSkills] = {}

    def init_context(self, env: ClipsEnvironment) -> None:
        self._skills_by_environment[env.name] = environment_skills = _EnvironmentSkills(env, self)
        env.define("call-skill-execution", environment_skills.call, 5, types="*;sy;sy;sy;sy;sy")
        env.define("call-skill-read", environment_skills.assert_states)
        env.define("call-skill-cancel", environment_skills.cancel, 1, types="*;sy")

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Cancel the environment's requests."""
        self._skills_by_environment.pop(env.name).close()


@dataclass(slots=True)
class _SkillCall:
    """A skill that the rules have called for an agent.

    :param action: the action on the skill board; None if the board rejected the request.
    :param error: the reason for a rejected request.
    """

    skill_id: str
    agent: str
    action: SkillAction | None
    error: str = ""

    @property
    def is_running(self) -> bool:
        return self.action is not None and not self.action.is_over

    @property
    def feedback(self) -> tuple[str, str]:
        """The status and the error for the rules; only a failed skill has an error."""
        if self.action is None:
            return "S_FAILED", self.error
        state = str(self.action.state)
        error = _CANCELLED if state == _CANCELLED else self.action.error
        return _STATUS_BY_STATE[state], error if _STATUS_BY_STATE[state] == "S_FAILED" else ""


class _EnvironmentSkills:
    """The skills that an environment has called: at most one for each agent."""

    def __init__(self, env: ClipsEnvironment, feature: SkillExecutionFeature) -> None:
        self._env, self._feature = env, feature
        self._log = env.bus.logger("skill_execution_feature")
        self._sensors = SimulatedSensors(env)
        self._calls: dict[str, _SkillCall] = {}

    def call(
        self, skill_id: str, action_name: str, parameter_text: str, mapped_action: str, agent: str
    ) -> None:
        """Request an executor for a skill, and cancel the skill that the agent still executes.

        :param parameter_text: the parameters of the action, separated by blanks.
        :param mapped_action: the skill string of the action; empty without an action mapping.
        :param agent: the id of the agent; may be empty.
        """
        self._log.info(
            f"Requesting skill ({action_name}, {parameter_text})"
            f" with mapped_action {mapped_action} for agent {agent}"
        )
        previous_call = self._calls.pop(str(agent), None)
        if previous_call is not None and previous_call.is_running:
            self._log.warn(f"Previous skill {previous_call.skill_id} is running: cancelled")
            self._cancel_action(previous_call)
        self._calls[str(agent)] = self._request_skill(
            str(skill_id), str(action_name), str(parameter_text), str(mapped_action), str(agent)
        )

    def _request_skill(
        self, skill_id: str, action_name: str, parameter_text: str, mapped_action: str, agent: str
    ) -> _SkillCall:
        skill_board = self._feature.get_skill_board()
        if skill_board is None:
            return _SkillCall(skill_id, agent, None, "there is no skill board")
        # the thesis' executive splits at each blank, and passes an empty parameter to a skill without any
        parameter_texts = (
            parameter_text.split(" ") if self._feature.repeats_defects else parameter_text.split()
        )
        parameters = {str(number): text for number, text in enumerate(parameter_texts, start=1)}
        if mapped_action:
            parameters[MAPPED_ACTION] = mapped_action
        try:
            # no callback for changes, since each tick reads the state
            skill_action = skill_board.request(
                action_name, parameters, agent or NO_AGENT, lambda _action: None, skill_id
            )
        except CxbridgeError as error:
            self._log.error(str(error))
            return _SkillCall(skill_id, agent, None, str(error))
        return _SkillCall(skill_id, agent, skill_action)

    def assert_states(self) -> None:
        """Assert simulated effects and the state of each skill, and remove the ended skills."""
        self._sensors.assert_effects()
        if not self._feature.repeats_defects and self._env.has_template(_FEEDBACK_TEMPLATE):
            # A fact of an earlier tick would set a skill back to its old state. The rule of skills.clp that
            # retracts these facts is never defined, because a parenthesis is missing.
            for index, _template, _slots in list(self._env.facts(_FEEDBACK_TEMPLATE)):
                self._env.retract(index)
        skill_board = self._feature.get_skill_board()
        for agent, call in sorted(self._calls.items()):
            action = call.action
            if skill_board is not None and action is not None:
                skill_board.apply_timeout(action)
            status, error = call.feedback
            self._env.assert_fact(
                _FEEDBACK_TEMPLATE,
                {
                    "skill-id": Symbol(call.skill_id),
                    "agent-id": call.agent,
                    "status": Symbol(status),
                    "error": error,
                },
            )
            is_unsensed = (
                skill_board is not None and action is not None and skill_board.lacks_sensors(action.executor)
            )
            if is_unsensed and status == "S_FINAL":
                # before the rules run, since at the end of a skill the rules retract the fact that connects
                # the skill with its plan-action
                self._sensors.add_skill(call.skill_id)
            if status in ("S_FINAL", "S_FAILED"):
                del self._calls[agent]
                self._feature.on_skill_removed()

    def cancel(self, agent: str) -> None:
        call = self._calls.get(str(agent))
        if call is None or call.action is None:
            self._log.error(f"Agent '{agent}' has no skill that could be cancelled")
        else:
            self._cancel_action(call)

    def _cancel_action(self, call: _SkillCall) -> None:
        skill_board = self._feature.get_skill_board()
        if skill_board is not None and call.action is not None:
            skill_board.cancel(call.action.number)

    def close(self) -> None:
        """Cancel all skills."""
        for call in self._calls.values():
            if call.is_running:
                self._cancel_action(call)
        self._calls.clear()


class SimulatedSensors:
    """Asserts the sensed effects of actions whose executors have no sensors, in one environment.

    An action with a sensed effect ends when a sensor reports the effect. Nothing senses the effects of
    dummies and of the executors in the setting ``unsensed``.
    """

    def __init__(self, env: ClipsEnvironment) -> None:
        self._env = env
        # ids of goal, plan and action of the executed actions
        self._executed_actions: set[tuple[Value, Value, Value]] = set()

    def add_skill(self, skill_id: str) -> None:
        """Record the action of an executed skill."""
        for _index, _template, slots in self._env.facts("skill-action-execinfo"):
            if slots["skill-id"] == skill_id:
                self._executed_actions.add((slots["goal-id"], slots["plan-id"], slots["action-id"]))

    def assert_effects(self) -> None:
        """Assert or retract the domain facts for whose change the recorded actions still wait."""
        if not self._executed_actions or not self._env.has_template(_PENDING_EFFECT_TEMPLATE):
            return
        effects = [slots for _, _, slots in self._env.facts(_PENDING_EFFECT_TEMPLATE)]
        if not effects:
            # forget the actions whose plans are gone, so that an idle executive need not search for effects
            self._executed_actions &= {
                (slots["goal-id"], slots["plan-id"], slots["id"])
                for _, _, slots in self._env.facts("plan-action")
            }
        for slots in effects:
            if (slots["goal-id"], slots["plan-id"], slots["action-id"]) in self._executed_actions:
                self._set_domain_fact(
                    slots["name"], slots["param-values"], is_true=slots["type"] == "POSITIVE"
                )

    def _set_domain_fact(self, predicate: Value, parameter_values: Value, *, is_true: bool) -> None:
        """Assert or retract a domain fact, unless it has the required truth value already."""
        indices = [
            index
            for index, _, slots in self._env.facts("domain-fact")
            if slots["name"] == predicate and slots["param-values"] == parameter_values
        ]
        if is_true and not indices:
            self._env.assert_fact(
                "domain-fact", {"name": Symbol(str(predicate)), "param-values": parameter_values}
            )
        elif not is_true:
            for index in indices:
                self._env.retract(index)
