"""Clients of ROS actions in rules: functions send goals; responses, feedback and results become facts."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from cxbridge.executive.host.values import TRUE, ExternalAddress, Symbol
from cxbridge_ros2.actions import ActionClient, GoalObserver, GoalStatus, SentGoal
from cxbridge_ros2.builtin_definitions import CANCEL_GOAL_TYPE
from cxbridge_ros2.names import parse_type
from cxbridge_ros2cx.cx.ros.plugin import (
    ADDRESS,
    FLOAT,
    INTEGER,
    STRING,
    SYMBOL,
    ClientEndpoint,
    ClientGroup,
    EndpointTable,
    FunctionDefinition,
    HandleTable,
    RosPlugin,
)

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge_ros2.messages import Message
    from cxbridge_ros2.names import TypeName

NO_HANDLE: Final = ExternalAddress(0)  # of a rejected goal, and of a request that concerns several goals

# the start of a separate range of addresses, as HandleTable requires
_FIRST_HANDLE: Final = 0x5100_0000_1000
_RESULT_CODE_NAMES: Final = {
    GoalStatus.SUCCEEDED: "SUCCEEDED",
    GoalStatus.CANCELED: "CANCELED",
    GoalStatus.ABORTED: "ABORTED",
}
# the names in action_msgs/srv/CancelGoal, by number
_RETURN_CODE_NAMES: Final = (
    "ERROR_NONE",
    "ERROR_REJECTED",
    "ERROR_UNKNOWN_GOAL_ID",
    "ERROR_GOAL_TERMINATED",
)


class _Names(Struct, frozen=True):
    """Names of functions, and of the templates ``client`` and ``feedback``, without the plug-in's prefix."""

    client: str
    create: str
    destroy: str
    send: str
    cancel: str
    destroy_handle: str
    feedback: str


# the names in the plug-in ros_msgs, then the names in generated plug-ins
_ROS_MSGS_NAMES: Final = _Names(
    client="action-client",
    create="create-action-client",
    destroy="destroy-action-client",
    send="async-send-goal",
    cancel="async-cancel-goal",
    destroy_handle="destroy-client-goal-handle",
    feedback="feedback",
)
_GENERATED_NAMES: Final = _Names(
    client="client",
    create="create-client",
    destroy="destroy-client",
    send="send-goal",
    cancel="client-cancel-goal",
    destroy_handle="client-goal-handle-destroy",
    feedback="goal-feedback",
)


class ActionClients(ClientGroup[ClientEndpoint]):
    """The action clients of a plug-in."""

    client_noun = "action"
    server_noun = "server"
    message_section = "Goal"

    def __init__(self, plugin: RosPlugin, prefix: str, type_name: TypeName | None = None) -> None:
        super().__init__(plugin, prefix, type_name)
        self.names = _ROS_MSGS_NAMES if type_name is None else _GENERATED_NAMES
        self.clients = EndpointTable(
            self, "action client", "Action client {name} not found in environment {env}"
        )
        self.handles: HandleTable[SentGoal] = HandleTable("goal handle", _FIRST_HANDLE)

    def define(self, env: ClipsEnvironment) -> None:
        plugin, prefix, names = self.plugin, self.prefix, self.names
        self._define_templates(env)
        functions: list[FunctionDefinition] = [
            (names.create, partial(self._create_client, env), "sy;sy" if self.type_name is None else "sy"),
            (names.destroy, partial(self.clients.close_endpoint, env), "sy"),
            (names.send, partial(self.send, env), "e;sy"),
            (names.cancel, partial(self._cancel_goal, env), "sy;e"),
            (names.destroy_handle, self.handles.destroy, "e"),
        ]
        cancel = partial(self._cancel_goals_before, env)  # without a time, for all goals
        if self.type_name is None:
            functions.append(("create-goal-request", self._create_goal_message, "sy"))
        else:
            functions += (
                ("client-cancel-all-goals", cancel, "sy"),
                ("client-cancel-goals-before", cancel, "sy;dl"),
            )
        plugin.define_functions(env, prefix, functions)
        self._define_handle_functions(env)

    def _create_goal_message(self, type_text: str) -> ExternalAddress:
        return self.plugin.messages.create(self.resolve_type(type_text, "action").derive("Goal"))

    def _define_templates(self, env: ClipsEnvironment) -> None:
        define, prefix, names = self.plugin.define_template, self.prefix, self.names
        is_generic = self.type_name is None
        define(env, f"{prefix}{names.client}", server=STRING, **({"type": STRING} if is_generic else {}))
        goal_slots = {"server": STRING, "client_goal_handle_ptr": ADDRESS}
        define(env, f"{prefix}goal-response", **goal_slots)
        define(env, f"{prefix}{names.feedback}", **goal_slots, feedback_ptr=ADDRESS)
        define(
            env,
            f"{prefix}wrapped-result",
            server=STRING,
            goal_id=SYMBOL if is_generic else STRING,
            code=SYMBOL,
            result_ptr=ADDRESS,
        )
        if is_generic:
            define(env, f"{prefix}cancel-response", **goal_slots, cancel_response_ptr=ADDRESS)
        else:
            define(env, f"{prefix}cancel-goal-response", server=STRING, return_code=SYMBOL, num_goals=INTEGER)
            define(env, f"{prefix}cancel-goal-entry", server=STRING, goal_id=STRING, stamp=FLOAT)

    def _define_handle_functions(self, env: ClipsEnvironment) -> None:
        find = self.handles.find

        def get_status(address: ExternalAddress) -> Value:
            goal_status = find(address).status
            return Symbol(goal_status.name) if self.type_name is None else int(goal_status)

        def is_aware(address: ExternalAddress) -> Value:
            """Return TRUE for each known goal: here every client gets feedback and results."""
            find(address)
            return TRUE

        self.plugin.define_functions(
            env,
            f"{self.prefix}client-goal-handle-",
            (
                ("get-goal-id", lambda address: self.format_goal_id(find(address)), "e"),
                ("get-goal-stamp", lambda address: find(address).accepted_s, "e"),
                ("get-status", get_status, "e"),
                ("is-feedback-aware", is_aware, "e"),
                ("is-result-aware", is_aware, "e"),
            ),
        )

    def format_goal_id(self, sent_goal: SentGoal) -> str:
        """Return the id of a goal: a SYMBOL in the plug-in ros_msgs, a STRING in generated plug-ins."""
        text = str(uuid.UUID(bytes=sent_goal.goal_id))
        return Symbol(text) if self.type_name is None else text

    def _create_client(self, env: ClipsEnvironment, server: str, type_text: str | None = None) -> None:
        if self.clients.get(env, server) is not None:
            self.plugin.log.warn(f"Already registered to action client for {server}")
            return
        type_name, ros = self.resolve_type(type_text, "action"), self.plugin.ros
        client = ActionClient(ros.node, ros.prepare_client(server, type_name), str(type_name))
        endpoint = ClientEndpoint(type_name, client.close, env, client)
        self.clients.add(
            env,
            server,
            endpoint,
            f"{self.prefix}{self.names.client}",
            {"server": str(server)} | self.make_type_slot(type_text),
        )

    def call(self, name: str, client: ClientEndpoint, fields: Mapping[str, Any]) -> None:
        client.ros_client.send(fields, _GoalFactWriter(self, client.env, name, client.type_name))

    def _cancel_goal(self, env: ClipsEnvironment, server: str, address: ExternalAddress) -> None:
        self.find(env, server)  # an error without a client, although the handle alone determines the goal
        self.handles.find(address).cancel()

    def _cancel_goals_before(self, env: ClipsEnvironment, server: str, time_s: float = 0.0) -> None:
        """Cancel the goals that a server accepted until a time, in seconds since the epoch; 0: all goals."""
        self.find(env, server).ros_client.cancel_goals_until(
            float(time_s), partial(self.assert_cancel_response, env, str(server), NO_HANDLE)
        )

    def assert_cancel_response(
        self, env: ClipsEnvironment, server: str, handle: ExternalAddress, response: Message
    ) -> None:
        """Assert a fact for a server's response to a cancel request.

        A generated plug-in also asserts a fact for each goal that the server cancels.

        :param handle: the handle of the goal, for the plug-in ros_msgs.
        """
        plugin, prefix = self.plugin, self.prefix
        if self.type_name is None:
            address = plugin.messages.add_received(
                parse_type(CANCEL_GOAL_TYPE, "srv").derive("Response"), response
            )
            plugin.assert_fact(
                env,
                f"{prefix}cancel-response",
                {"server": server, "client-goal-handle-ptr": handle, "cancel-response-ptr": address},
            )
            return
        code, goals = response["return_code"], response["goals_canceling"]
        name = _RETURN_CODE_NAMES[code] if 0 <= code < len(_RETURN_CODE_NAMES) else "ERROR_UNKNOWN"
        plugin.assert_fact(
            env,
            f"{prefix}cancel-goal-response",
            {"server": server, "return-code": Symbol(name), "num-goals": len(goals)},
        )
        for goal in goals:
            plugin.assert_fact(
                env,
                f"{prefix}cancel-goal-entry",
                {
                    "server": server,
                    "goal-id": str(uuid.UUID(bytes=bytes(goal["goal_id"]["uuid"]))),
                    "stamp": goal["stamp"]["sec"] + goal["stamp"]["nanosec"] / 1e9,
                },
            )


class _GoalFactWriter(GoalObserver):
    """Asserts a fact for each event of a goal."""

    def __init__(
        self, clients: ActionClients, env: ClipsEnvironment, server: str, type_name: TypeName
    ) -> None:
        self._clients, self._env, self._server, self._type_name = clients, env, server, type_name
        self._handle = NO_HANDLE

    def _add_goal_fact(self, name: str, slots: Mapping[str, Value]) -> None:
        clients = self._clients
        if clients.clients.get(self._env, self._server) is not None:  # rules may have destroyed the client
            clients.plugin.assert_fact(
                self._env, f"{clients.prefix}{name}", {"server": self._server, **slots}
            )

    def on_response(self, sent_goal: SentGoal) -> None:
        if sent_goal.is_accepted:
            self._handle = self._clients.handles.add(sent_goal)
        self._add_goal_fact("goal-response", {"client-goal-handle-ptr": self._handle})

    def on_feedback(self, sent_goal: SentGoal, feedback: Message) -> None:  # noqa: ARG002 - of GoalObserver
        address = self._clients.plugin.messages.add_received(self._type_name.derive("Feedback"), feedback)
        self._add_goal_fact(
            self._clients.names.feedback,
            {"client-goal-handle-ptr": self._handle, "feedback-ptr": address},
        )

    def on_end(self, sent_goal: SentGoal) -> None:
        messages, type_name = self._clients.plugin.messages, self._type_name.derive("Result")
        # a goal without a result, e.g. after the end of its server, gets the default result
        address = (
            messages.add_received(type_name, sent_goal.result)
            if sent_goal.result
            else messages.create(type_name)
        )
        self._add_goal_fact(
            "wrapped-result",
            {
                "goal-id": self._clients.format_goal_id(sent_goal),
                "code": Symbol(_RESULT_CODE_NAMES.get(sent_goal.status, "UNKNOWN")),
                "result-ptr": address,
            },
        )

    def on_cancel_response(self, sent_goal: SentGoal, response: Message) -> None:  # noqa: ARG002 - of GoalObserver
        self._clients.assert_cancel_response(self._env, self._server, self._handle, response)
