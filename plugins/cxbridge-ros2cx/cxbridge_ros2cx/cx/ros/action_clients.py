"""Action clients in rules: functions send goals; responses, feedback and results become facts."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, Symbol
from cxbridge_ros2.actions import ActionClient, GoalObserver, GoalStatus, SentGoal
from cxbridge_ros2.builtin import CANCEL_GOAL
from cxbridge_ros2.names import parse_type
from cxbridge_ros2cx.cx.ros.plugin import ADDRESS, FLOAT, INTEGER, STRING, SYMBOL, Handles, RosPlugin
from cxbridge_ros2cx.cx.ros.services import copied

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge_ros2.messages import Message
    from cxbridge_ros2.names import TypeName

NO_HANDLE: Final = ExternalAddress(0)  # handle of a rejected goal

# addresses of different kinds have different ranges, so a mixed-up handle is unknown
_FIRST_HANDLE: Final = 0x5100_0000_1000
_CODES: Final = {
    GoalStatus.SUCCEEDED: "SUCCEEDED",
    GoalStatus.CANCELED: "CANCELED",
    GoalStatus.ABORTED: "ABORTED",
}
_RETURN_CODES: Final = ("ERROR_NONE", "ERROR_REJECTED", "ERROR_UNKNOWN_GOAL_ID", "ERROR_GOAL_TERMINATED")
_Key = tuple[str, str]  # environment, server


class _Names(Struct, frozen=True):
    """Names of functions and templates behind the plug-in's prefix."""

    client: str
    create: str
    destroy: str
    send: str
    cancel: str
    destroy_handle: str
    feedback: str


_TYPED: Final = _Names(
    "action-client",
    "create-action-client",
    "destroy-action-client",
    "async-send-goal",
    "async-cancel-goal",
    "destroy-client-goal-handle",
    "feedback",
)
_GENERATED: Final = _Names(
    "client",
    "create-client",
    "destroy-client",
    "send-goal",
    "client-cancel-goal",
    "client-goal-handle-destroy",
    "goal-feedback",
)


class _OpenClient(Struct, eq=False):
    kind: TypeName
    client: ActionClient
    fact: int | None
    waiting: list[Mapping[str, Any]]  # goals that wait for the server


class ActionClients:
    """The action clients of a plug-in.

    :param prefix: the prefix of functions and templates: ``ros-msgs-``.
    :param kind: the type of all actions; None if functions take the type as an argument.
    """

    def __init__(self, plugin: RosPlugin, prefix: str, kind: TypeName | None = None) -> None:
        self.plugin, self.prefix, self.kind = plugin, prefix, kind
        self._names = _TYPED if kind is None else _GENERATED
        self._clients: dict[_Key, _OpenClient] = {}
        self._environments: dict[str, ClipsEnvironment] = {}
        self.handles: Handles[SentGoal] = Handles("goal handle", _FIRST_HANDLE)

    def define(self, env: ClipsEnvironment) -> None:
        plugin, prefix, names = self.plugin, self.prefix, self._names
        self._environments[env.name] = env
        self._define_templates(env)
        types = "sy;sy" if self.kind is None else "sy"
        plugin.define(env, f"{prefix}{names.create}", partial(self._create, env), types)
        plugin.define(env, f"{prefix}{names.destroy}", partial(self._end, env), "sy")
        plugin.define(env, f"{prefix}{names.send}", partial(self._send, env), "e;sy")
        plugin.define(env, f"{prefix}{names.cancel}", partial(self._cancel, env), "sy;e")
        plugin.define(env, f"{prefix}{names.destroy_handle}", self.handles.destroy, "e")
        if self.kind is None:
            plugin.define(env, f"{prefix}create-goal-request", self._create_goal, "sy")
        else:
            plugin.define(env, f"{prefix}client-cancel-all-goals", partial(self._cancel_until, env), "sy")
            plugin.define(
                env, f"{prefix}client-cancel-goals-before", partial(self._cancel_until, env), "sy;dl"
            )
        self._define_handles(env)

    def _define_templates(self, env: ClipsEnvironment) -> None:
        template, prefix, names = self.plugin.template, self.prefix, self._names
        typed = self.kind is None
        template(env, f"{prefix}{names.client}", server=STRING, **({"type": STRING} if typed else {}))
        template(env, f"{prefix}goal-response", server=STRING, client_goal_handle_ptr=ADDRESS)
        handle = {"server": STRING, "client_goal_handle_ptr": ADDRESS}
        template(env, f"{prefix}{names.feedback}", **handle, feedback_ptr=ADDRESS)
        goal_id = SYMBOL if typed else STRING
        template(
            env, f"{prefix}wrapped-result", server=STRING, goal_id=goal_id, code=SYMBOL, result_ptr=ADDRESS
        )
        if typed:
            template(env, f"{prefix}cancel-response", **handle, cancel_response_ptr=ADDRESS)
        else:
            template(
                env, f"{prefix}cancel-goal-response", server=STRING, return_code=SYMBOL, num_goals=INTEGER
            )
            template(env, f"{prefix}cancel-goal-entry", server=STRING, goal_id=STRING, stamp=FLOAT)

    def _define_handles(self, env: ClipsEnvironment) -> None:
        find = self.handles.find
        typed = self.kind is None

        def status(address: ExternalAddress) -> Value:
            found = find(address).status
            return Symbol(found.name) if typed else int(found)

        def aware(address: ExternalAddress) -> Value:
            return TRUE if find(address) else FALSE

        def goal_id(address: ExternalAddress) -> Value:
            return self._id(find(address))

        for name, function in (
            ("get-goal-id", goal_id),
            ("get-goal-stamp", lambda address: find(address).stamp),
            ("get-status", status),
            ("is-feedback-aware", aware),
            ("is-result-aware", aware),
        ):
            self.plugin.define(env, f"{self.prefix}client-goal-handle-{name}", function, "e")

    def _id(self, sent: SentGoal) -> str:
        text = str(uuid.UUID(bytes=sent.goal_id))
        return Symbol(text) if self.kind is None else text

    def _create(self, env: ClipsEnvironment, server: str, text: str | None = None) -> None:
        key = env.name, str(server)
        if key in self._clients:
            self.plugin.log.warn(f"Already registered to action client for {server}")
            return
        kind = self.kind if self.kind is not None else parse_type(str(text), "action")
        client = ActionClient(self.plugin.ros.node, self.plugin.ros.reach(server, kind), str(kind))
        slots: dict[str, Value] = {"server": str(server)}
        if self.kind is None:
            slots["type"] = str(text)
        fact = self.plugin.add_fact(env, f"{self.prefix}{self._names.client}", slots)
        self._clients[key] = _OpenClient(kind, client, fact, [])

    def _create_goal(self, text: str) -> Value:
        return self.plugin.messages.create(parse_type(text, "action").derived("Goal"))

    def _find(self, env: ClipsEnvironment, server: str) -> _OpenClient:
        entry = self._clients.get((env.name, str(server)))
        if entry is None:
            raise ClipsError(f"there is no client of the action {server}: create a client first")
        return entry

    def _send(self, env: ClipsEnvironment, message: ExternalAddress, server: str) -> None:
        """Send a goal as soon as a server exists."""
        entry, view = self._find(env, server), self.plugin.messages.find(message)
        if view.kind != entry.kind.derived("Goal"):
            raise ClipsError(f"the action {server} has the type {entry.kind}, the message {view.kind}")
        if entry.client.is_served and not entry.waiting:
            self._call(env, str(server), entry, view.fields)
            return
        if not entry.waiting:
            self.plugin.log.warn(f"server {server} not available, start waiting")
        # rules may change or destroy the message before the server appears
        entry.waiting.append(copied(view.fields))

    def _call(self, env: ClipsEnvironment, server: str, entry: _OpenClient, goal: Mapping[str, Any]) -> None:
        entry.client.send(goal, _GoalFacts(self, env, server, entry.kind))

    def tick(self) -> None:
        """Send the goals whose servers have appeared."""
        for (name, server), entry in list(self._clients.items()):
            if entry.waiting and entry.client.is_served:
                self.plugin.log.info(f"server {server} is finally reachable")
                while entry.waiting:
                    self._call(self._environments[name], server, entry, entry.waiting.pop(0))

    def _cancel(self, env: ClipsEnvironment, server: str, address: ExternalAddress) -> None:
        self._find(env, server)
        self.handles.find(address).cancel()

    def _cancel_until(self, env: ClipsEnvironment, server: str, seconds: float = 0.0) -> None:
        done = partial(self.cancel_answered, env, str(server), NO_HANDLE)
        self._find(env, server).client.cancel_until(float(seconds), done)

    def cancel_answered(
        self, env: ClipsEnvironment, server: str, handle: ExternalAddress, response: Message
    ) -> None:
        """Assert a server's response to a cancel request."""
        plugin, prefix = self.plugin, self.prefix
        if self.kind is None:
            kind = parse_type(CANCEL_GOAL, "srv").derived("Response")
            address = plugin.messages.take(kind, response)
            slots = {"server": server, "client-goal-handle-ptr": handle, "cancel-response-ptr": address}
            plugin.add_fact(env, f"{prefix}cancel-response", slots)
            return
        code, goals = response["return_code"], response["goals_canceling"]
        name = _RETURN_CODES[code] if 0 <= code < len(_RETURN_CODES) else "ERROR_UNKNOWN"
        plugin.add_fact(
            env,
            f"{prefix}cancel-goal-response",
            {"server": server, "return-code": Symbol(name), "num-goals": len(goals)},
        )
        for each in goals:
            stamp = each["stamp"]["sec"] + each["stamp"]["nanosec"] / 1e9
            goal_id = str(uuid.UUID(bytes=bytes(each["goal_id"]["uuid"])))
            plugin.add_fact(
                env, f"{prefix}cancel-goal-entry", {"server": server, "goal-id": goal_id, "stamp": stamp}
            )

    def is_open(self, env: ClipsEnvironment, server: str) -> bool:
        return (env.name, server) in self._clients

    def _end(self, env: ClipsEnvironment, server: str) -> None:
        entry = self._clients.pop((env.name, str(server)), None)
        if entry is None:
            self.plugin.log.warn(f"Action client {server} not found in environment {env.name}")
            return
        entry.client.close()
        if entry.fact is not None:
            env.retract(entry.fact)

    def close(self, env: ClipsEnvironment) -> None:
        """Close the clients that an environment has left open, with a warning."""
        for key in [key for key in self._clients if key[0] == env.name]:
            self._clients.pop(key).client.close()
            self.plugin.log.warn(f"Environment {env.name} has open {key[1]} action client, cleaning up ...")


class _GoalFacts(GoalObserver):
    """Asserts the events of a goal in order."""

    def __init__(self, clients: ActionClients, env: ClipsEnvironment, server: str, kind: TypeName) -> None:
        self._clients, self._env, self._server, self._kind = clients, env, server, kind
        self._handle = NO_HANDLE

    def _add(self, name: str, slots: Mapping[str, Value]) -> None:
        clients = self._clients
        if clients.is_open(self._env, self._server):
            clients.plugin.add_fact(self._env, f"{clients.prefix}{name}", {"server": self._server, **slots})

    def answered(self, sent: SentGoal) -> None:
        if sent.is_accepted:
            self._handle = self._clients.handles.add(sent)
        self._add("goal-response", {"client-goal-handle-ptr": self._handle})

    def feedback(self, sent: SentGoal, feedback: Message) -> None:  # noqa: ARG002
        name = "feedback" if self._clients.kind is None else "goal-feedback"
        address = self._clients.plugin.messages.take(self._kind.derived("Feedback"), feedback)
        self._add(name, {"client-goal-handle-ptr": self._handle, "feedback-ptr": address})

    def ended(self, sent: SentGoal) -> None:
        messages, kind = self._clients.plugin.messages, self._kind.derived("Result")
        address = messages.take(kind, sent.result) if sent.result else messages.create(kind)
        self._add(
            "wrapped-result",
            {
                "goal-id": str(uuid.UUID(bytes=sent.goal_id))
                if self._clients.kind is not None
                else Symbol(uuid.UUID(bytes=sent.goal_id)),
                "code": Symbol(_CODES.get(sent.status, "UNKNOWN")),
                "result-ptr": address,
            },
        )

    def cancel_answered(self, sent: SentGoal, response: Message) -> None:  # noqa: ARG002
        self._clients.cancel_answered(self._env, self._server, self._handle, response)
