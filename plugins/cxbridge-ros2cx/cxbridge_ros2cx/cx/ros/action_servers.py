"""Action servers in rules: a deffunction accepts goals, rules execute them by their handles."""

from __future__ import annotations

import uuid
from functools import partial
from typing import TYPE_CHECKING, Final

from msgspec import Struct

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress
from cxbridge.rights import Right
from cxbridge_ros2.actions import GoalHandler, GoalResponse, GoalServer, GoalStatus, ServedGoal
from cxbridge_ros2cx.cx.ros.plugin import ADDRESS, STRING, Handles, RosPlugin

if TYPE_CHECKING:
    from collections.abc import Callable

    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge_ros2.names import TypeName

# addresses of different kinds have different ranges, so a mixed-up handle is unknown
_FIRST_HANDLE: Final = 0x5200_0000_1000
_CANCEL_ACCEPTED: Final = 2  # rclcpp_action::CancelResponse::ACCEPT


class _OpenServer(Struct, eq=False):
    server: GoalServer
    handler: GoalHandler
    fact: int | None


class ActionServers:
    """The action servers of a generated plug-in.

    :param prefix: the prefix of functions and templates: ``example-interfaces-fibonacci-``.
    """

    def __init__(self, plugin: RosPlugin, prefix: str, kind: TypeName) -> None:
        self.plugin, self.prefix, self.kind = plugin, prefix, kind
        self._servers: dict[tuple[str, str], _OpenServer] = {}
        self.handles: Handles[ServedGoal] = Handles("goal handle or result pointer", _FIRST_HANDLE)

    def define(self, env: ClipsEnvironment) -> None:
        plugin, prefix = self.plugin, self.prefix
        plugin.template(env, f"{prefix}server", name=STRING)
        plugin.template(env, f"{prefix}accepted-goal", server=STRING, server_goal_handle_ptr=ADDRESS)
        plugin.define(env, f"{prefix}create-server", partial(self._create, env), "sy")
        plugin.define(env, f"{prefix}destroy-server", partial(self._end, env), "sy")
        handle = f"{prefix}server-goal-handle-"
        for name, status in (
            ("abort", GoalStatus.ABORTED),
            ("succeed", GoalStatus.SUCCEEDED),
            ("canceled", GoalStatus.CANCELED),
        ):
            plugin.define(env, f"{handle}{name}", self._reported(partial(self._finish, status)), "e;e")
        feedback = self._reported(self._publish_feedback)
        plugin.define(env, f"{handle}publish-feedback", feedback, "e;e")
        for name, function in (
            ("get-goal", self._goal),
            ("get-goal-id", lambda address: _id(self.handles.find(address))),
            ("is-canceling", partial(self._has_status, GoalStatus.CANCELING)),
            ("is-executing", partial(self._has_status, GoalStatus.EXECUTING)),
            ("is-active", partial(self._has_status, *GoalStatus.__members__.values())),
            ("execute", lambda address: self.handles.find(address).execute()),
            ("destroy", self.handles.destroy),
        ):
            plugin.define(env, f"{handle}{name}", self._reported(function), "e")

    def _reported(self, function: Callable[..., Value]) -> Callable[..., Value]:
        """Return a function that logs an unknown handle and then returns FALSE."""

        def call(*arguments: Value) -> Value:
            try:
                return function(*arguments)
            except ClipsError as error:
                self.plugin.log.error(str(error))
                return FALSE

        return call

    def _create(self, env: ClipsEnvironment, server: str) -> None:
        key = env.name, str(server)
        if key in self._servers:
            self.plugin.log.warn(f"Already registered to server {server}")
            return
        ros, handler = self.plugin.ros, _Handler(self, env, str(server))
        goal_server = GoalServer(
            ros.node,
            ros.whole(server),
            str(self.kind),
            handler,
            self.plugin.context.clock,
            needs=Right.CONTROL,
        )
        fact = self.plugin.add_fact(env, f"{self.prefix}server", {"name": str(server)})
        self._servers[key] = _OpenServer(goal_server, handler, fact)

    def handler(self, env: ClipsEnvironment, server: str) -> GoalHandler | None:
        """Return the handler of an environment's server; None without such a server."""
        entry = self._servers.get((env.name, server))
        return None if entry is None else entry.handler

    def _goal(self, address: ExternalAddress) -> Value:
        goal = self.handles.find(address).goal
        return self.plugin.messages.take(self.kind.derived("Goal"), goal)

    def _has_status(self, *arguments: GoalStatus | ExternalAddress) -> Value:
        """Return whether an active goal has one of the given states."""
        *states, address = arguments
        assert isinstance(address, ExternalAddress)
        status = self.handles.find(address).status
        return TRUE if status in states and not status.is_final else FALSE

    def _message(self, address: ExternalAddress, part: str) -> dict[str, object]:
        view = self.plugin.messages.find(address)
        if view.kind != self.kind.derived(part):
            raise ClipsError(f"a {self.kind.derived(part)} is wanted, not a {view.kind}")
        return view.fields

    def _finish(self, status: GoalStatus, address: ExternalAddress, result: ExternalAddress) -> None:
        served = self.handles.find(address)
        if served.status.is_final:
            raise ClipsError(f"the goal has ended: {served.status.name}")
        served.finish(status, self._message(result, "Result"))

    def _publish_feedback(self, address: ExternalAddress, feedback: ExternalAddress) -> None:
        self.handles.find(address).publish_feedback(self._message(feedback, "Feedback"))

    def _end(self, env: ClipsEnvironment, server: str) -> None:
        entry = self._servers.pop((env.name, str(server)), None)
        if entry is None:
            self.plugin.log.warn(f"Server {server} not found in environment {env.name}")
            return
        entry.server.close()
        if entry.fact is not None:
            env.retract(entry.fact)

    def close(self, env: ClipsEnvironment) -> None:
        """Close the servers that an environment has left open, with a warning."""
        for key in [key for key in self._servers if key[0] == env.name]:
            self._servers.pop(key).server.close()
            self.plugin.log.warn(f"Environment {env.name} has open {key[1]} server, cleaning up ...")


class _Handler(GoalHandler):
    """Calls deffunctions for the goals of a server at once."""

    def __init__(self, servers: ActionServers, env: ClipsEnvironment, server: str) -> None:
        self._servers, self._env, self._server = servers, env, server
        self._addresses: dict[bytes, ExternalAddress] = {}

    def _call(self, name: str, *arguments: Value) -> Value:
        """Call a deffunction with the server's name; return None if undefined, 1 if it fails."""
        function = f"{self._servers.prefix}{name}-callback"
        with self._env.lock:
            if not self._env.has_deffunction(function):
                return None
            try:
                return self._env.call(function, self._server, *arguments)
            except ClipsError as error:
                self._servers.plugin.log.error(str(error))
                return 1

    def _goal(self, served: ServedGoal) -> ExternalAddress:
        return self._servers.plugin.messages.take(self._servers.kind.derived("Goal"), served.goal)

    def respond(self, served: ServedGoal) -> GoalResponse:
        """Let the deffunction decide about a goal; without a deffunction, accept and execute."""
        goal = self._goal(served)
        answer = self._call("handle-goal", goal, _id(served))
        self._servers.plugin.messages.destroy(goal)
        if answer is None:
            return GoalResponse.ACCEPT_AND_EXECUTE
        if isinstance(answer, int) and answer in list(GoalResponse):
            return GoalResponse(answer)
        self._servers.plugin.log.error(f"Invalid goal response from CLIPS: {answer}")
        return GoalResponse.REJECT

    def begin(self, served: ServedGoal) -> None:
        address = self._addresses[served.goal_id] = self._servers.handles.add(served)
        slots = {"server": self._server, "server-goal-handle-ptr": address}
        self._servers.plugin.add_fact(self._env, f"{self._servers.prefix}accepted-goal", slots)

    def may_cancel(self, served: ServedGoal) -> bool:
        """Let the deffunction decide about a cancel request; without a deffunction, accept."""
        goal = self._goal(served)
        answer = self._call("cancel-goal", goal, self._addresses[served.goal_id])
        self._servers.plugin.messages.destroy(goal)
        return answer is None or answer == _CANCEL_ACCEPTED


def _id(served: ServedGoal) -> str:
    return str(uuid.UUID(bytes=served.goal_id))
