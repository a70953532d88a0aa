"""The environment of Gymnasium, with the spaces of the class ``CXRLGym`` of the ROS 2 CX."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete
from numpy.typing import NDArray

from cxbridge.errors import CxbridgeError
from cxbridge_ros2cx.rl.learning_agent import LEARNER_NODE, Decision, LearningAgent
from cxbridge_ros2cx.rl.spaces import Groundings, Observation

_DONE_INFO = "Done"  # the text in the agent's result at the end of an episode
# the outcomes in ``CXRLGym`` by the text in the agent's result
_OUTCOMES = {_DONE_INFO: "Game Over", "Aborted": "RESET"}


class ClipsGym(gymnasium.Env[Observation, np.int64]):
    """An agent of ``cx_rl_clips``: its rules give observations, executable actions and rewards.

    An observation has 1 for each true predicate. An action is an index of :attr:`actions`;
    ``info["action_mask"]`` and :meth:`action_masks` are 1 for each action that the free robot can execute. A
    step lasts until the action has ended.

    :param parameters: the parameter file of ``clips_manager``.
    :param ros2cx: the checkout or workspace with the packages of the agent.
    :param node: the name of the learner's node.
    :param patience: the time limit of an action or a reset, in seconds of the agent's clock.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - the base class declares it like this

    def __init__(
        self,
        parameters: str | Path,
        ros2cx: str | Path | None = None,
        *,
        node: str = LEARNER_NODE,
        patience: float = 600.0,
    ) -> None:
        self._folder = TemporaryDirectory(prefix="cxbridge-rl-")
        try:
            self.agent = LearningAgent(
                Path(parameters),
                None if ros2cx is None else Path(ros2cx),
                Path(self._folder.name),
                node=node,
                patience=patience,
            )
        except BaseException:  # also after an interrupt: close() is never called then
            self._folder.cleanup()
            raise
        self._groundings = Groundings.from_agent(self.agent)
        self.observables = self._groundings.predicate_indices  # index of each predicate in an observation
        self.actions = self._groundings.actions  # names of the actions by index
        self.observation_space = Box(0.0, 1.0, (len(self.observables),), np.float32)
        self.action_space = Discrete(len(self.actions))
        self._decision: Decision | None = None
        self.agent.status = {
            "mode": "TRAINING",
            "current_episode": 0,
            "current_episode_step": 0,
            "total_steps": 0,
        }

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; the agent's facts return to their initial state."""
        super().reset(seed=seed, options=options)
        status = self.agent.status
        status["current_episode"] += 1
        status["current_episode_step"] = 0
        self.agent.reset()
        self._decision = self.agent.next_decision()
        return self._encode_observation(), self._make_step_info("")

    def step(self, action: np.int64 | int) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Let the free robot execute an action; an action that the robot cannot execute has no effect.

        :raises CxbridgeError: before the first :meth:`reset`, or if the agent does not finish the action.
        """
        if self._decision is None:
            raise CxbridgeError("no episode has begun", hint="call reset() first")
        status = self.agent.status
        status["current_episode_step"] += 1
        status["total_steps"] += 1
        action_id = self._decision.actions.get(self.actions[int(action)])
        result: Mapping[str, Any]
        if action_id is None:
            result = self.agent.call_service("get_episode_end", "GetEpisodeEnd")
            is_over, outcome = bool(result["episode_end"]), "NO-ACTION-FOR-ROBOT"
        else:
            result = self.agent.execute_action(action_id)
            is_over, outcome = result["info"] == _DONE_INFO, _OUTCOMES.get(result["info"], "")
            if not is_over:
                self._decision = self.agent.next_decision()
        return (
            self._encode_observation(),
            float(result["reward"]),
            is_over,
            False,  # never truncated: the agent alone ends an episode
            self._make_step_info(outcome),
        )

    def action_masks(self) -> NDArray[np.int8]:
        """Return 1 for each action that the free robot can execute, or for ``no-op`` alone without any."""
        return self._groundings.make_action_mask(self._decision.actions if self._decision else ())

    def close(self) -> None:
        """End the training and the run."""
        self.agent.close()
        self._folder.cleanup()

    def _encode_observation(self) -> Observation:
        return self._groundings.encode_observation(self.agent.observations())

    def _make_step_info(self, outcome: str) -> dict[str, Any]:
        """Return the info of a step: its outcome as in ``CXRLGym``, the free robot, and its actions."""
        robot = self._decision.robot if self._decision else ""
        return {"outcome": outcome, "robot": robot, "action_mask": self.action_masks()}
