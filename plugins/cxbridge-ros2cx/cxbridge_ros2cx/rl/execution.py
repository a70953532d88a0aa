"""Agents whose actions a trained policy chooses: the mode EXECUTION of the original's ``cx_rl_node``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cxbridge.errors import CxbridgeError
from cxbridge_ros2cx.rl.interface import NODE, LearningAgent, text_of
from cxbridge_ros2cx.rl.spaces import NO_OP, Mask, Observation, Spaces

# Returns the index of an action for an observation and the mask of executable actions.
Policy = Callable[[Observation, Mask], int]


def execute(
    parameters: str | Path,
    policy: Policy,
    ros2cx: str | Path | None = None,
    *,
    seconds: float,
    node: str = NODE,
    watch: bool = False,
) -> list[str]:
    """Run an agent of ``cx_rl_clips`` with a policy that chooses its actions; return the chosen actions.

    The run ends after ``seconds`` of the agent's clock, or when the agent shuts down. The spaces are those of
    the environment in which the policy was trained.

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
        chosen: list[str] = []
        spaces = Spaces.of(agent)

        def choose(request: Mapping[str, Any]) -> Mapping[str, Any]:
            executable = dict(zip(map(text_of, request["actions"]), request["action_ids"], strict=True))
            if executable.keys().isdisjoint(spaces.numbers):
                return {"action_id": NO_OP}
            observed = map(text_of, request["observations"])
            number = int(policy(spaces.observation(observed), spaces.mask(executable)))
            action = spaces.actions[number] if 0 <= number < len(spaces.actions) else str(number)
            if action not in executable:
                raise CxbridgeError(
                    f"the policy chose the action {action}, which the robot cannot execute",
                    hint=f"the executable actions are: {', '.join(executable)}",
                )
            chosen.append(action)
            return {"action_id": executable[action]}

        agent.serve("exec_action_selection", "ExecActionSelection", choose)
        # the agent asks for actions once a model is loaded
        agent.status["model_loaded"] = True
        agent.run_for(seconds)
        return chosen
