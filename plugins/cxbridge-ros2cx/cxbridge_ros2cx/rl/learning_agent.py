"""Runs a learning agent of the ROS 2 CX on the virtual clock, and replaces the agent's peer.

In carologistics/clips_executive the peer of an agent is the learner, the node ``cx_rl_node``. The learner
calls services of the agent, and sends goals of the actions ``reset_env`` and ``action_selection``. Here goals
go directly to the handlers of the agent's action servers, which is faster than messages. Observations and
executable actions come from the facts that the agent's services read.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

from msgspec import Struct

from cxbridge.clock import MICROSECONDS
from cxbridge.closing import Closing
from cxbridge.errors import CxbridgeError
from cxbridge.run import Run
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge_ros2.actions import GoalStatus, ServedGoal
from cxbridge_ros2.names import parse_type
from cxbridge_ros2cx.cx.node import CxNode
from cxbridge_ros2cx.cx.plugins.generated import GeneratedPlugin

if TYPE_CHECKING:
    from cxbridge.executive.host.values import Value
    from cxbridge_ros2.actions import GoalHandler
    from cxbridge_ros2.messages import Message
    from cxbridge_ros2.node import Client
    from cxbridge_ros2cx.cx.stock import StockEnvironment

LEARNER_NODE: Final = "/cx_rl_node"  # the peer's name, unless the agent's `?*CX-RL-NODE-NAME*` differs

_PACKAGE: Final = "cx_rl_interfaces"
_NO_OBJECTS_TEXT: Final = "Not found"  # the agent's response for a type without objects
_STORAGE_PARAMETER: Final = "storage_dir"
# time on the agent's clock until its action servers must exist, and it must call `get_status`; chosen freely
_STARTUP_TIMEOUT_S: Final = 10.0
_NO_TIMEOUT_S: Final = 1e9  # 30 years: the learner decides when the run ends


ResultT = TypeVar("ResultT")


class Decision(Struct, frozen=True):
    """The decision about the next action, which the agent waits for.

    :param robot: the robot that is free; empty after the end of the episode.
    :param actions: the ids of the executable actions by name, e.g. ``stack(robot1#a#b)``.
    """

    robot: str
    actions: Mapping[str, str]


class _Goal(ServedGoal):
    """A goal without messages, which stores its result."""

    def __init__(self, goal: Message) -> None:
        self.goal_id, self.goal = os.urandom(16), goal
        self.status, self.is_cancel_requested = GoalStatus.EXECUTING, False
        self.result: Mapping[str, Any] | None = None

    def publish_feedback(self, feedback: Mapping[str, Any]) -> None:
        """Do nothing: the learner needs only the result."""

    def execute(self) -> None:
        """Do nothing: the goal executes from the start."""

    def finish(self, status: GoalStatus, result: Mapping[str, Any]) -> None:
        self.status, self.result = status, dict(result)


class LearningAgent(Closing):
    """The agent of a parameter file, in a run whose clock advances only during the methods of this class.

    :param parameters: the parameter file of ``clips_manager``.
    :param ros2cx: the checkout or workspace with the packages of the agent; None if there is none.
    :param storage: a folder for the initial facts of each episode.
    :param node: the name of the peer.
    :param patience: the time limit of a service, a goal or a decision, in seconds of the agent's clock.
    :raises CxbridgeError: if the parameters are invalid, no environment has the templates of ``cx_rl_clips``,
        or the agent does not serve both actions and call ``get_status`` in time.
    """

    def __init__(
        self,
        parameters: Path,
        ros2cx: Path | None,
        storage: Path,
        *,
        node: str = LEARNER_NODE,
        patience: float = 600.0,
    ) -> None:
        self._peer_name, self._patience = node, patience
        self._file = parameters
        self._clients: dict[str, Client] = {}
        self.status: dict[str, Any] = {"mode": "TRAINING"}  # the peer's response to the service `get_status`
        with ExitStack() as stack:
            options = options_from_keywords(parameters, ros2cx=ros2cx, clock="virtual", timeout=_NO_TIMEOUT_S)
            self._run = stack.enter_context(Run(options))
            executive = self._run.executive
            if not isinstance(executive, CxNode):
                raise CxbridgeError("these are not parameters of clips_manager", file=parameters)
            self._manager = executive.manager
            self._manager.context.parameters.set_default(_STORAGE_PARAMETER, str(storage))
            self._run.start()
            self._graph = self._manager.context.ros.graph
            self._peer = self._graph.join(node.rpartition("/")[2])
            self._peer.serve(f"{node}/get_status", f"{_PACKAGE}/srv/GetStatus", lambda _request: self.status)
            self._env = self._find_environment()
            self._env.eval("(unwatch all)")  # steps with traces take several times as long
            self._goal_handlers = {
                name: self._find_goal_handler(name, type_name)
                for name, type_name in (("reset_env", "ResetEnv"), ("action_selection", "ActionSelection"))
            }
            self._run_until(
                self._find_training_mode, f"the agent does not call {node}/get_status", _STARTUP_TIMEOUT_S
            )
            self._tick()  # in this tick the agent saves the facts with which episodes begin
            self._stack = stack.pop_all()  # the run stays open until close()

    def close(self) -> None:
        """End the training and the run."""
        if self._ensure_client("end_training", "EndTraining").has_server:
            self.call_service("end_training", "EndTraining")
        self._stack.close()

    # --- the run ------------------------------------------------------------------------------------------

    def _find_environment(self) -> StockEnvironment:
        for name in self._manager.environments:
            env = self._manager.stock_environment(name)
            if env.has_template("cx-rl-node"):
                return env
        raise CxbridgeError(
            "no environment has the templates of cx_rl_clips",
            file=self._file,
            hint="the agent loads cx-rl.clp of the package cx_rl_clips",
        )

    def _find_goal_handler(self, action: str, type_name: str) -> GoalHandler:
        action_type = parse_type(f"{_PACKAGE}/action/{type_name}")

        def find_handler() -> GoalHandler | None:
            for plugin in self._manager.plugins.values():
                if isinstance(plugin, GeneratedPlugin) and plugin.type_name == action_type:
                    for handler in plugin.find_handlers(self._env, f"{self._peer_name}/{action}"):
                        return handler
            return None

        return self._run_until(
            find_handler, f"the action {self._peer_name}/{action} has no server", _STARTUP_TIMEOUT_S
        )

    def _run_until(
        self, find: Callable[[], ResultT | None], timeout_message: str, timeout_s: float = 0.0
    ) -> ResultT:
        """Advance the agent's time until a function returns a result; return the result.

        :param find: returns None as long as there is no result.
        :param timeout_s: the time limit; 0 for the limit of the constructor.
        :raises CxbridgeError: if the time is over or the agent has shut down.
        """
        clock, executive = self._run.clock, self._run.executive
        end_us = clock.now_us() + int((timeout_s or self._patience) * MICROSECONDS)
        while (result := find()) is None:
            if clock.now_us() >= end_us or executive.is_over:
                hint = executive.first_error and f"the first error of the agent: {executive.first_error}"
                message = "the agent has shut down" if executive.is_over else timeout_message
                raise CxbridgeError(message, file=self._file, hint=hint or None)
            self._tick()
        return result

    def _tick(self) -> None:
        self._run.clock.sleep_until(self._run.clock.now_us() + self._run.loop.period_us)
        self._run.loop.run_once()

    def _find_training_mode(self) -> str | None:
        """Return TRAINING if the agent knows this mode of the learner, else None."""
        modes = map(tuple, self._env.columns("cx-rl-node", "name", "mode"))
        return "TRAINING" if (self._peer_name, "TRAINING") in modes else None

    # --- services and goals -------------------------------------------------------------------------------

    def _ensure_client(self, service: str, type_name: str) -> Client:
        if service not in self._clients:
            self._clients[service] = self._peer.create_client(
                f"{self._peer_name}/{service}", f"{_PACKAGE}/srv/{type_name}"
            )
        return self._clients[service]

    def call_service(self, service: str, type_name: str, **request: Any) -> Message:
        """Call a service of the agent with the fields of a request; return the response."""
        responses: list[Message] = []
        client = self._ensure_client(service, type_name)
        self._run_until(
            lambda: client.has_server or None, f"the service {self._peer_name}/{service} has no server"
        )
        client.call(request, responses.append)
        self._graph.settle()
        return self._run_until(
            lambda: next(iter(responses), None), f"{self._peer_name}/{service} does not answer"
        )

    def _send_goal(self, action: str, timeout_message: str, **goal: Any) -> Mapping[str, Any]:
        """Let the agent execute a goal; return the result."""
        handler, sent_goal = self._goal_handlers[action], _Goal(goal)
        # the deffunction logs the goal; the decision is ignored, since cx_rl_clips accepts each goal
        handler.decide(sent_goal)
        handler.begin(sent_goal)
        return self._run_until(lambda: sent_goal.result, timeout_message)

    def reset(self) -> None:
        """Let the agent reset itself for the next episode."""
        self._send_goal("reset_env", "the agent does not end its reset")

    def execute_action(self, action_id: str) -> Mapping[str, Any]:
        """Let the agent execute an action; return the result with reward and info.

        :param action_id: the id of the action, from a :class:`Decision`.
        """
        return self._send_goal(
            "action_selection", f"the agent does not finish the action {action_id}", action_id=action_id
        )

    # --- spaces and facts ----------------------------------------------------------------------------------

    def observables(self) -> list[str]:
        """Return the groundings that observations may contain."""
        predefined_response = self.call_service("get_predefined_observables", "GetPredefinedObservables")
        predicate_response = self.call_service("get_observable_predicates", "GetObservablePredicates")
        return [
            *map(format_message, predefined_response["observables"]),
            *self._ground_names(predicate_response["predicate_names"], predicate_response),
        ]

    def all_actions(self) -> list[str]:
        """Return the groundings of all actions, whether executable or not."""
        predefined_response = self.call_service("get_predefined_actions", "GetPredefinedActions")
        action_response = self.call_service("get_observable_actions", "GetObservableActions")
        return [
            *map(format_message, predefined_response["actions"]),
            *self._ground_names(action_response["action_names"], action_response),
        ]

    def _ground_names(self, names: Iterable[str], name_response: Message) -> Iterable[str]:
        """Yield the groundings of predicates or actions with all objects of the parameters' types.

        As in ``CXRLGym``, a predicate or an action without parameters has no grounding.

        :param name_response: the response with the names, which also has the number and the types of the
            parameters.
        """
        objects: dict[str, list[str]] = {}
        type_names = iter(name_response["param_types"])
        for name, count in zip(names, name_response["param_counts"], strict=True):
            parameters = [next(type_names) for _ in range(count)]
            for type_name in parameters:
                if type_name not in objects:
                    response = self.call_service(
                        "get_observable_objects", "GetObservableObjects", type=type_name
                    )
                    objects[type_name] = [text for text in response["objects"] if text != _NO_OBJECTS_TEXT]
            if parameters:
                for arguments in product(*(objects[type_name] for type_name in parameters)):
                    yield format_grounding(name, arguments)

    def observations(self) -> Iterable[str]:
        """Yield the groundings of the current observations."""
        for node, name, parameters in self._env.columns("rl-observation", "node", "name", "params"):
            if node == self._peer_name:
                yield format_grounding(name, parameters)

    def next_decision(self) -> Decision:
        """Advance the agent's time until a robot is free or the episode has ended; return the decision."""
        return self._run_until(self._find_decision, "no robot becomes free")

    def _find_decision(self) -> Decision | None:
        """Return a decision if a robot waits and the agent has asserted all executable actions, else None.

        At the end of the episode, the decision has neither a robot nor actions.
        """
        action_spaces = self._env.columns("rl-current-action-space", "node", "state")
        if (self._peer_name, "DONE") not in map(tuple, action_spaces):
            return None
        robots = self._env.columns("rl-robot", "node", "waiting", "name")
        waiting_robots = {
            name for node, is_waiting, name in robots if node == self._peer_name and is_waiting == "TRUE"
        }
        actions_of_robots: dict[str, dict[str, str]] = {}
        for node, robot, is_selected, action_id, name, parameters in self._env.columns(
            "rl-action", "node", "assigned-to", "is-selected", "id", "name", "params"
        ):
            if node == self._peer_name and robot in waiting_robots and is_selected == "FALSE":
                actions_of_robots.setdefault(str(robot), {})[format_grounding(name, parameters)] = str(
                    action_id
                )
        if actions_of_robots:
            robot, actions = next(iter(actions_of_robots.items()))
            return Decision(robot, actions)
        is_over = (self._peer_name,) in map(tuple, self._env.columns("rl-episode-end", "node"))
        return Decision("", {}) if waiting_robots and is_over else None


def format_grounding(name: Value, parameters: Value) -> str:
    """Return a predicate or an action with its objects in the notation of ``CXRLGym``: ``on(a#b)``."""
    assert isinstance(parameters, tuple)
    return f"{name}({'#'.join(map(str, parameters))})" if parameters else str(name)


def format_message(message: Message) -> str:
    """Return the predicate or action of a message in the notation of ``CXRLGym``."""
    return format_grounding(message["name"], tuple(message["params"]))
