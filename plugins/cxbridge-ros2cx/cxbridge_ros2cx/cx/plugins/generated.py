"""``cx::CX<Package><Type>Plugin``: the generated plug-ins of the original, per message, service or action.

Here the class is built at run time from the definition of the type.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cxbridge_ros2.names import TypeName, parse_type
from cxbridge_ros2cx.cx.ros.action_clients import ActionClients
from cxbridge_ros2cx.cx.ros.action_servers import ActionServers
from cxbridge_ros2cx.cx.ros.plugin import RosPlugin
from cxbridge_ros2cx.cx.ros.services import ServiceClients, ServiceServers
from cxbridge_ros2cx.cx.ros.topics import Topics

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_ros2.actions import GoalHandler
    from cxbridge_ros2cx.cx.plugin import NodeContext

CLASS: Final = re.compile(r"cx::CX(\w+)Plugin")
_UPPER: Final = re.compile(r"([A-Z])(?=[A-Z][a-z])")
_WORD: Final = re.compile(r"([a-z0-9])([A-Z])")


def class_name(kind: TypeName) -> str:
    return f"cx::CX{_camel(kind)}Plugin"


def prefix_of(kind: TypeName) -> str:
    """Return the prefix of a type's functions and templates: ``std-msgs-string-``."""
    hyphenated = _WORD.sub(r"\1-\2", _UPPER.sub(r"\1-", _camel(kind)))
    return f"{hyphenated.lower()}-"


def _camel(kind: TypeName) -> str:
    return "".join(part[:1].upper() + part[1:] for part in kind.package.split("_")) + kind.name


def find_type(class_text: str, context: NodeContext) -> TypeName | None:
    if CLASS.fullmatch(class_text) is None:
        return None
    kinds = map(parse_type, context.ros.definitions.names())
    return next((kind for kind in kinds if class_name(kind) == class_text), None)


class GeneratedPlugin(RosPlugin):
    """The functions and templates of a type.

    :param kind: the message, service or action.
    """

    def __init__(self, name: str, context: NodeContext, kind: TypeName) -> None:
        super().__init__(name, context)
        self.kind = kind
        self._environments: dict[str, ClipsEnvironment] = {}
        prefix = prefix_of(kind)
        self._messages: tuple[tuple[str, TypeName, str, str], ...]
        if kind.kind == "msg":
            self._messages = ((prefix, kind, "create-message", "destroy-message"),)
            self._parts: tuple[Topics | ServiceClients | ServiceServers | ActionClients | ActionServers, ...]
            self._parts = (Topics(self, prefix, kind),)
            return
        parts = ("Request", "Response") if kind.kind == "srv" else ("Goal", "Feedback", "Result")
        self._messages = tuple(
            (f"{prefix}{part.lower()}-", kind.derived(part), "create", "destroy") for part in parts
        )
        if kind.kind == "srv":
            self._parts = (ServiceClients(self, prefix, kind), ServiceServers(self, prefix, kind))
        else:
            self._parts = (ActionClients(self, prefix, kind), ActionServers(self, prefix, kind))

    def init_context(self, env: ClipsEnvironment) -> None:
        self._environments[env.name] = env
        for prefix, kind, create, destroy in self._messages:
            self.define_message(env, prefix, kind, create, destroy)
        for part in self._parts:
            part.define(env)

    def handlers(self, env: ClipsEnvironment, server: str) -> list[GoalHandler]:
        servers = (part for part in self._parts if isinstance(part, ActionServers))
        return [handler for part in servers if (handler := part.handler(env, server)) is not None]

    def tick(self) -> None:
        """Send requests that were waiting for their server."""
        for part in self._parts:
            if isinstance(part, ServiceClients):
                part.tick(self._environments.get)
            elif isinstance(part, ActionClients):
                part.tick()

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Close the environment's open requests."""
        for part in self._parts:
            part.close(env)
        self._environments.pop(env.name, None)
