"""Action servers in rules: a deffunction accepts goals, rules execute them by their handles."""

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
    Endpoints,
    EndpointTable,
    Handles,
    RosPlugin,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge_ros2.names import TypeName

# see Handles: each kind of handle has a separate range
_FIRST_HANDLE: Final = 0x5200_0000_1000
_CANCEL_ACCEPTED: Final = 2  # rclcpp_action::CancelResponse::ACCEPT


class _Server(Endpoint):
    handler: GoalHandler


class ActionServers(Endpoints):
    """The action servers of a generated plug-in."""

    kind: TypeName

    def __init__(self, plugin: RosPlugin, prefix: str, kind: TypeName) -> None:
        super().__init__(plugin, prefix, kind)
        self._servers: EndpointTable[_Server] = EndpointTable(
            plugin, "server", "Server {name} not found in environment {env}"
        )
        self.handles: Handles[ServedGoal] = Handles("goal handle or result pointer", _FIRST_HANDLE)

    def define(self, env: ClipsEnvironment) -> None:
        plugin, prefix = self.plugin, self.prefix
        plugin.template(env, f"{prefix}server", name=STRING)
        plugin.template(env, f"{prefix}accepted-goal", server=STRING, server_goal_handle_ptr=ADDRESS)
        plugin.define(env, f"{prefix}create-server", partial(self._create, env), "sy")
        plugin.define(env, f"{prefix}destroy-server", partial(self._servers.end, env), "sy")
        functions: tuple[tuple[str, Callable[..., Value], str], ...] = (
            ("abort", partial(self._finish, GoalStatus.ABORTED), "e;e"),
            ("succeed", partial(self._finish, GoalStatus.SUCCEEDED), "e;e"),
            ("canceled", partial(self._finish, GoalStatus.CANCELED), "e;e"),
            ("publish-feedback", self._publish_feedback, "e;e"),
            ("get-goal", self._goal, "e"),
            ("get-goal-id", lambda address: _id_text(self.handles.find(address)), "e"),
            ("is-canceling", partial(self._has_status, GoalStatus.CANCELING), "e"),
            ("is-executing", partial(self._has_status, GoalStatus.EXECUTING), "e"),
            ("is-active", partial(self._has_status, *GoalStatus.__members__.values()), "e"),
            ("execute", lambda address: self.handles.find(address).execute(), "e"),
            ("destroy", self.handles.destroy, "e"),
        )
        for name, function, types in functions:
            plugin.define(env, f"{prefix}server-goal-handle-{name}", self._with_error_log(function), types)

    def _with_error_log(self, function: Callable[..., Value]) -> Callable[..., Value]:
        """Return a function that logs an unknown handle and then returns FALSE."""

        def call(*arguments: Value) -> Value:
            try:
                return function(*arguments)
            except ClipsError as error:
                self.plugin.log.error(str(error))
                return FALSE

        return call

    def _create(self, env: ClipsEnvironment, server: str) -> None:
        if self._servers.get(env, server) is not None:
            self.plugin.log.warn(f"Already registered to server {server}")
            return
        ros, handler = self.plugin.ros, _Handler(self, env, str(server))
        goal_server = GoalServer(
            ros.node,
            ros.full_name(server),
            str(self.kind),
            handler,
            self.plugin.context.clock,
            right=Right.CONTROL,
        )
        fact = self.plugin.add_fact(env, f"{self.prefix}server", {"name": str(server)})
        self._servers[env, server] = _Server(self.kind, goal_server.close, fact, handler)

    def handler(self, env: ClipsEnvironment, server: str) -> GoalHandler | None:
        """Return the handler of an environment's server; None without such a server."""
        endpoint = self._servers.get(env, server)
        return None if endpoint is None else endpoint.handler

    def _goal(self, address: ExternalAddress) -> Value:
        goal = self.handles.find(address).goal
        return self.plugin.messages.take(self.kind.derive("Goal"), goal)

    def _has_status(self, *arguments: GoalStatus | ExternalAddress) -> Value:
        """Return whether an active goal has one of the given states; the last argument is its handle."""
        *states, address = arguments
        assert isinstance(address, ExternalAddress)
        status = self.handles.find(address).status
        return TRUE if status in states and not status.is_final else FALSE

    def _fields(self, address: ExternalAddress, suffix: str) -> dict[str, object]:
        """Return the fields of a message after a check of its type."""
        view, kind = self.plugin.messages.find(address), self.kind.derive(suffix)
        if view.kind != kind:
            raise ClipsError(f"a {kind} is wanted, not a {view.kind}")
        return view.fields

    def _finish(self, status: GoalStatus, address: ExternalAddress, result: ExternalAddress) -> None:
        served = self.handles.find(address)
        if served.status.is_final:
            raise ClipsError(f"the goal has ended: {served.status.name}")
        served.finish(status, self._fields(result, "Result"))

    def _publish_feedback(self, address: ExternalAddress, feedback: ExternalAddress) -> None:
        self.handles.find(address).publish_feedback(self._fields(feedback, "Feedback"))

    def close(self, env: ClipsEnvironment) -> None:
        self._servers.close(env)


class _Handler(GoalHandler):
    """Calls deffunctions for the goals of a server at once."""

    def __init__(self, servers: ActionServers, env: ClipsEnvironment, server: str) -> None:
        self._servers, self._env, self._server = servers, env, server
        self._plugin, self._prefix = servers.plugin, servers.prefix
        self._addresses: dict[bytes, ExternalAddress] = {}

    def _call(self, name: str, served: ServedGoal, argument: Value) -> Value:
        """Call a deffunction with a goal and an argument; return None if undefined, 1 if it fails."""
        function, messages = f"{self._prefix}{name}-callback", self._plugin.messages
        goal = messages.take(self._servers.kind.derive("Goal"), served.goal)
        try:
            with self._env.lock:
                if not self._env.has_deffunction(function):
                    return None
                return self._env.call(function, self._server, goal, argument)
        except ClipsError as error:
            self._plugin.log.error(str(error))
            return 1  # REJECT, for a goal and for a cancel request
        finally:
            messages.destroy(goal)  # the deffunction has the message during the call only

    def decide(self, served: ServedGoal) -> GoalResponse:
        """Let the deffunction decide about a goal; without a deffunction, accept and execute."""
        response = self._call("handle-goal", served, _id_text(served))
        if response is None:
            return GoalResponse.ACCEPT_AND_EXECUTE
        if isinstance(response, int) and response in list(GoalResponse):
            return GoalResponse(response)
        self._plugin.log.error(f"Invalid goal response from CLIPS: {response}")
        return GoalResponse.REJECT

    def begin(self, served: ServedGoal) -> None:
        # the address is kept: a later cancel request names the goal by its id
        address = self._addresses[served.goal_id] = self._servers.handles.add(served)
        slots = {"server": self._server, "server-goal-handle-ptr": address}
        self._plugin.add_fact(self._env, f"{self._prefix}accepted-goal", slots)

    def may_cancel(self, served: ServedGoal) -> bool:
        """Let the deffunction decide about a cancel request; without a deffunction, accept."""
        response = self._call("cancel-goal", served, self._addresses[served.goal_id])
        return response is None or response == _CANCEL_ACCEPTED


def _id_text(served: ServedGoal) -> str:
    return str(uuid.UUID(bytes=served.goal_id))
