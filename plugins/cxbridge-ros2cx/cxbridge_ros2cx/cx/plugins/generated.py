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

# The messages in a definition of a service or an action.
SECTIONS: Final = {"msg": (), "srv": ("Request", "Response"), "action": ("Goal", "Feedback", "Result")}

CLASS: Final = re.compile(r"cx::CX(\w+)Plugin")
# the ends of words in StdMsgsTFMessage: T|F and s|T
_UPPER: Final = re.compile(r"([A-Z])(?=[A-Z][a-z])")
_WORD: Final = re.compile(r"([a-z0-9])([A-Z])")


def class_name(kind: TypeName) -> str:
    return f"cx::CX{_camel(kind)}Plugin"


def prefix_of(kind: TypeName) -> str:
    """Return the prefix of a type's functions and templates: ``std-msgs-string-``."""
    hyphenated = _WORD.sub(r"\1-\2", _UPPER.sub(r"\1-", _camel(kind)))
    return f"{hyphenated.lower()}-"


def _camel(kind: TypeName) -> str:
    return "".join(word[:1].upper() + word[1:] for word in kind.package.split("_")) + kind.name


def find_type(class_text: str, context: NodeContext) -> TypeName | None:
    """Return the type whose generated plug-in has a class name; None if no known type has."""
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
        prefix = prefix_of(kind)
        if kind.kind == "msg":
            self.endpoints = (Topics(self, prefix, kind),)
        elif kind.kind == "srv":
            self.endpoints = (ServiceClients(self, prefix, kind), ServiceServers(self, prefix, kind))
        else:
            self.endpoints = (ActionClients(self, prefix, kind), ActionServers(self, prefix, kind))

    def init_context(self, env: ClipsEnvironment) -> None:
        kind, prefix = self.kind, prefix_of(self.kind)
        if kind.kind == "msg":
            self.define_message(env, prefix, kind, "create-message", "destroy-message")
        for section in SECTIONS[kind.kind]:
            self.define_message(env, f"{prefix}{section.lower()}-", kind.derive(section), "create", "destroy")
        for endpoints in self.endpoints:
            endpoints.define(env)

    def handlers(self, env: ClipsEnvironment, server: str) -> list[GoalHandler]:
        """Return the handlers of an action server of an environment; empty without such a server."""
        servers = (endpoints for endpoints in self.endpoints if isinstance(endpoints, ActionServers))
        return [handler for endpoints in servers if (handler := endpoints.handler(env, server)) is not None]
