"""Servers of ROS actions in rules: a deffunction accepts goals, rules execute the goals by their handles."""

from __future__ import annotations

import uuid
from functools import partial
from typing import TYPE_CHECKING, Final

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress
from cxbridge.rights import Right
from cxbridge_ros2.actions import GoalHandler, GoalResponse, GoalServer, GoalStatus, ServedGoal
from cxbridge_ros2cx.cx.ros.plugin import (
    ADDRESS,
    STRING,
    Endpoint,
    EndpointGroup,
    EndpointTable,
    FunctionDefinition,
    HandleTable,
    RosPlugin,
)

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge_ros2.names import TypeName

# the start of a separate range of addresses, as HandleTable requires
_FIRST_HANDLE: Final = 0x5200_0000_1000
_CANCEL_ACCEPTED: Final = 2  # rclcpp_action::CancelResponse::ACCEPT
_REJECTED: Final = 1  # REJECT both in rclcpp_action::GoalResponse and in rclcpp_action::CancelResponse


class _ActionServerEndpoint(Endpoint):
    handler: GoalHandler


class ActionServers(EndpointGroup):
    """The action servers of a generated plug-in."""

    type_name: TypeName  # never None: the plug-in ros_msgs has no action servers

    def __init__(self, plugin: RosPlugin, prefix: str, type_name: TypeName) -> None:
        super().__init__(plugin, prefix, type_name)
        self._servers: EndpointTable[_ActionServerEndpoint] = EndpointTable(
            self, "server", "Server {name} not found in environment {env}"
        )
        self.handles: HandleTable[ServedGoal] = HandleTable("goal handle or result pointer", _FIRST_HANDLE)

    def define(self, env: ClipsEnvironment) -> None:
        plugin, prefix, find = self.plugin, self.prefix, self.handles.find
        plugin.define_template(env, f"{prefix}server", name=STRING)
        plugin.define_template(env, f"{prefix}accepted-goal", server=STRING, server_goal_handle_ptr=ADDRESS)
        functions: tuple[FunctionDefinition, ...] = (
            ("abort", partial(self._finish_goal, GoalStatus.ABORTED), "e;e"),
            ("succeed", partial(self._finish_goal, GoalStatus.SUCCEEDED), "e;e"),
            ("canceled", partial(self._finish_goal, GoalStatus.CANCELED), "e;e"),
            ("publish-feedback", self._publish_feedback, "e;e"),
            ("get-goal", self._get_goal, "e"),
            ("get-goal-id", lambda address: _format_goal_id(find(address)), "e"),
            ("is-canceling", partial(self._has_status, GoalStatus.CANCELING), "e"),
            ("is-executing", partial(self._has_status, GoalStatus.EXECUTING), "e"),
            ("is-active", partial(self._has_status, *GoalStatus.__members__.values()), "e"),
            ("execute", lambda address: find(address).execute(), "e"),
            ("destroy", self.handles.destroy, "e"),
        )
        plugin.define_functions(
            env,
            prefix,
            [
                ("create-server", partial(self._create_server, env), "sy"),
                ("destroy-server", partial(self._servers.close_endpoint, env), "sy"),
                *(
                    (f"server-goal-handle-{name}", plugin.with_false_on_error(function), types)
                    for name, function, types in functions
                ),
            ],
        )

    def _create_server(self, env: ClipsEnvironment, server: str) -> None:
        # Rules may give the name as a Symbol, a subclass of `str`: `str(server)` is a STRING for the fact and
        # for the arguments of deffunctions.
        if self._servers.get(env, server) is not None:
            self.plugin.log.warn(f"Already registered to server {server}")
            return
        ros, handler = self.plugin.ros, _DeffunctionGoalHandler(self, env, str(server))
        goal_server = GoalServer(
            ros.node,
            ros.full_name(server),
            str(self.type_name),
            handler,
            self.plugin.context.clock,
            right=Right.CONTROL,
        )
        self._servers.add(
            env,
            server,
            _ActionServerEndpoint(self.type_name, goal_server.close, handler),
            f"{self.prefix}server",
            {"name": str(server)},
        )

    def find_handler(self, env: ClipsEnvironment, server: str) -> GoalHandler | None:
        """Return the handler of an environment's server; None if there is no such server."""
        endpoint = self._servers.get(env, server)
        return None if endpoint is None else endpoint.handler

    def _get_goal(self, address: ExternalAddress) -> Value:
        return self.plugin.messages.add_received(
            self.type_name.derive("Goal"), self.handles.find(address).goal
        )

    def _has_status(self, *arguments: GoalStatus | ExternalAddress) -> Value:
        """Return TRUE if a goal has not ended and has one of some states, else FALSE.

        :param arguments: the states, then the handle of the goal.
        """
        *states, address = arguments
        assert isinstance(address, ExternalAddress)
        status = self.handles.find(address).status
        return TRUE if status in states and not status.is_final else FALSE

    def _find_fields(self, address: ExternalAddress, section: str) -> dict[str, object]:
        """Return the fields of the message at an address.

        :param section: the part of the action's definition: ``Result`` or ``Feedback``.
        :raises ClipsError: if the message has another type.
        """
        view, message_type = self.plugin.messages.find(address), self.type_name.derive(section)
        if view.type_name != message_type:
            raise ClipsError(f"the message must be a {message_type}, not a {view.type_name}")
        return view.fields

    def _finish_goal(self, status: GoalStatus, address: ExternalAddress, result: ExternalAddress) -> None:
        served_goal = self.handles.find(address)
        if served_goal.status.is_final:
            raise ClipsError(f"the goal has ended: {served_goal.status.name}")
        served_goal.finish(status, self._find_fields(result, "Result"))

    def _publish_feedback(self, address: ExternalAddress, feedback: ExternalAddress) -> None:
        self.handles.find(address).publish_feedback(self._find_fields(feedback, "Feedback"))


class _DeffunctionGoalHandler(GoalHandler):
    """Decides about the goals of a server by deffunctions, and asserts a fact for each accepted goal."""

    def __init__(self, servers: ActionServers, env: ClipsEnvironment, server: str) -> None:
        self._servers, self._env, self._server = servers, env, server
        self._plugin, self._prefix = servers.plugin, servers.prefix
        self._goal_addresses: dict[bytes, ExternalAddress] = {}

    def _call_deffunction(self, name: str, served_goal: ServedGoal, argument: Value) -> Value:
        """Call a deffunction with the name of the server, a goal and an argument.

        :param name: the deffunction's name without the prefix and ``-callback``.
        :returns: the value of the deffunction, FALSE if it returns none; None without such a deffunction,
            :data:`_REJECTED` after an error.
        """
        deffunction, messages = f"{self._prefix}{name}-callback", self._plugin.messages
        goal_address = messages.add_received(self._servers.type_name.derive("Goal"), served_goal.goal)
        try:
            with self._env.lock:
                if not self._env.has_deffunction(deffunction):
                    return None
                value = self._env.call(deffunction, self._server, goal_address, argument)
                return FALSE if value is None else value
        except ClipsError as error:
            self._plugin.log.error(str(error))
            return _REJECTED
        finally:
            messages.destroy(goal_address)  # the address is valid during the call only

    def decide(self, served_goal: ServedGoal) -> GoalResponse:
        """Let the deffunction decide about a goal; without a deffunction, accept and execute the goal.

        An error in the deffunction, or a value that :class:`GoalResponse` lacks, rejects the goal.
        """
        response = self._call_deffunction("handle-goal", served_goal, _format_goal_id(served_goal))
        if response is None:
            return GoalResponse.ACCEPT_AND_EXECUTE
        if isinstance(response, int) and response in list(GoalResponse):
            return GoalResponse(response)
        self._plugin.log.error(f"Invalid goal response from CLIPS: {response}")
        return GoalResponse.REJECT

    def begin(self, served_goal: ServedGoal) -> None:
        # the address is kept: a later cancel request names the goal by its id
        address = self._goal_addresses[served_goal.goal_id] = self._servers.handles.add(served_goal)
        self._plugin.assert_fact(
            self._env,
            f"{self._prefix}accepted-goal",
            {"server": self._server, "server-goal-handle-ptr": address},
        )

    def may_cancel(self, served_goal: ServedGoal) -> bool:
        """Return whether the deffunction accepts a cancel request; True without a deffunction."""
        response = self._call_deffunction(
            "cancel-goal", served_goal, self._goal_addresses[served_goal.goal_id]
        )
        return response is None or response == _CANCEL_ACCEPTED


def _format_goal_id(served_goal: ServedGoal) -> str:
    return str(uuid.UUID(bytes=served_goal.goal_id))
