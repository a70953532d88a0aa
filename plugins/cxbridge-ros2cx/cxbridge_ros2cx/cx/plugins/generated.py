"""The plug-ins ``cx::CX<Package><Type>Plugin``, one for each ROS message, service or action.

The build of the ROS 2 CX generates these classes. Here :class:`GeneratedPlugin` stands in for all of
them, and uses the definition of its type at run time.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from cxbridge_ros2.names import TypeName, parse_type
from cxbridge_ros2cx.cx.ros.action_clients import ActionClients
from cxbridge_ros2cx.cx.ros.action_servers import ActionServers
from cxbridge_ros2cx.cx.ros.plugin import EndpointGroup, RosPlugin
from cxbridge_ros2cx.cx.ros.services import ServiceClients, ServiceServers
from cxbridge_ros2cx.cx.ros.topics import Topics

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_ros2.actions import GoalHandler
    from cxbridge_ros2cx.cx.plugin import NodeContext

# the message types that a definition contains, by the kind of the definition
MESSAGE_SECTIONS: Final = {
    "msg": (),
    "srv": ("Request", "Response"),
    "action": ("Goal", "Feedback", "Result"),
}

_ENDPOINT_CLASSES: Final[dict[str, tuple[Callable[[RosPlugin, str, TypeName], EndpointGroup], ...]]] = {
    "msg": (Topics,),
    "srv": (ServiceClients, ServiceServers),
    "action": (ActionClients, ActionServers),
}

CLASS_PATTERN: Final = re.compile(r"cx::CX\w+Plugin")
# the ends of words in StdMsgsTFMessage: TF|Message, and Msgs|TF
_CAPITALS_END: Final = re.compile(r"([A-Z])(?=[A-Z][a-z])")
_WORD_END: Final = re.compile(r"([a-z0-9])([A-Z])")


def make_generated_class_name(type_name: TypeName) -> str:
    return f"cx::CX{_make_camel_case_name(type_name)}Plugin"


def make_name_prefix(type_name: TypeName) -> str:
    """Return the prefix of a type's functions and templates: ``std-msgs-string-``."""
    name = _CAPITALS_END.sub(r"\1-", _make_camel_case_name(type_name))
    return _WORD_END.sub(r"\1-\2", name).lower() + "-"


def _make_camel_case_name(type_name: TypeName) -> str:
    return "".join(word[:1].upper() + word[1:] for word in type_name.package.split("_")) + type_name.name


def find_type(class_name: str, context: NodeContext) -> TypeName | None:
    """Return the type whose generated plug-in has a class name; None if there is no such type."""
    if CLASS_PATTERN.fullmatch(class_name) is None:
        return None
    for type_name in map(parse_type, context.ros.definitions.find_names()):
        if make_generated_class_name(type_name) == class_name:
            return type_name
    return None


class GeneratedPlugin(RosPlugin):
    """Defines the functions and templates of a ROS type.

    :param type_name: the message, service or action.
    """

    def __init__(self, name: str, context: NodeContext, type_name: TypeName) -> None:
        super().__init__(name, context)
        self.type_name = type_name
        prefix = make_name_prefix(type_name)
        self.endpoint_groups = tuple(
            endpoint_class(self, prefix, type_name) for endpoint_class in _ENDPOINT_CLASSES[type_name.kind]
        )

    def init_context(self, env: ClipsEnvironment) -> None:
        type_name, prefix = self.type_name, make_name_prefix(self.type_name)
        if type_name.kind == "msg":
            self.define_message(env, prefix, type_name, "create-message", "destroy-message")
        for section in MESSAGE_SECTIONS[type_name.kind]:
            self.define_message(
                env, f"{prefix}{section.lower()}-", type_name.derive(section), "create", "destroy"
            )
        for group in self.endpoint_groups:
            group.define(env)

    def find_handlers(self, env: ClipsEnvironment, server: str) -> list[GoalHandler]:
        """Return the handlers of an environment's action server; empty if there is no such server."""
        return [
            handler
            for group in self.endpoint_groups
            if isinstance(group, ActionServers) and (handler := group.find_handler(env, server)) is not None
        ]
