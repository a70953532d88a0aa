"""Runs a learning agent whose actions a trained policy chooses.

This is the mode EXECUTION of the node ``cx_rl_node`` of the ROS 2 CX.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cxbridge.errors import CxbridgeError
from cxbridge_ros2cx.rl.interface import LEARNER_NODE, LearningAgent, format_message
from cxbridge_ros2cx.rl.spaces import NO_OP, ActionMask, Groundings, Observation

# returns the index of an action for an observation and the mask of executable actions
Policy = Callable[[Observation, ActionMask], int]


def execute(
    parameters: str | Path,
    policy: Policy,
    ros2cx: str | Path | None = None,
    *,
    seconds: float,
    node: str = LEARNER_NODE,
    watch: bool = False,
) -> list[str]:
    """Run an agent of ``cx_rl_clips`` with a policy that chooses its actions; return the chosen actions.

    The run ends after ``seconds`` of the agent's clock, or when the agent shuts down. Observations and
    actions have the same indices as in the environment for training.

    :param parameters: the parameter file of ``clips_manager``.
    :param ros2cx: the checkout or workspace with the packages of the agent.
    :param node: the name of the learner's node.
    :param watch: whether to log facts and rules.
    :raises CxbridgeError: if the agent is invalid, or the policy chooses an action outside its mask.
    """
    folder = None if ros2cx is None else Path(ros2cx)
    with (
        TemporaryDirectory(prefix="cxbridge-rl-") as storage,
        LearningAgent(
            Path(parameters), folder, Path(storage), node=node, watch=watch, mode="EXECUTION"
        ) as agent,
    ):
        chosen_actions: list[str] = []
        spaces = Groundings.from_agent(agent)

        def choose_action(request: Mapping[str, Any]) -> Mapping[str, Any]:
            executable = dict(
                zip(map(format_message, request["actions"]), request["action_ids"], strict=True)
            )
            if executable.keys().isdisjoint(spaces.action_indices):
                return {"action_id": NO_OP}
            observed_predicates = map(format_message, request["observations"])
            action_index = int(
                policy(spaces.encode_observation(observed_predicates), spaces.make_action_mask(executable))
            )
            action = (
                spaces.actions[action_index] if 0 <= action_index < len(spaces.actions) else str(action_index)
            )
            if action not in executable:
                raise CxbridgeError(
                    f"the policy chose the action {action}, which the robot cannot execute",
                    hint=f"the executable actions are: {', '.join(executable)}",
                )
            chosen_actions.append(action)
            return {"action_id": executable[action]}

        agent.serve("exec_action_selection", "ExecActionSelection", choose_action)
        # the agent waits for a loaded model before it asks for actions
        agent.status["model_loaded"] = True
        agent.run_for(seconds)
        return chosen_actions
