"""The parameters of a node, which clients read: six services, and the topic /parameter_events.

Clients cannot set a parameter: the services answer that the parameters are read-only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, TypeAlias

from cxbridge.clock import Clock
from cxbridge.closing import Closing
from cxbridge.rights import right_of_frame
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Node
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.stamps import us_to_stamp

# The value of a parameter. The elements of a list have one type.
ParameterValue: TypeAlias = bool | int | float | str | list[bool] | list[int] | list[float] | list[str]

EVENTS_TOPIC: Final = "/parameter_events"
_PACKAGE: Final = "rcl_interfaces"
_SEPARATOR: Final = "."
_READ_ONLY: Final = "the parameters of this node are read-only"

# By Python class: the number in rcl_interfaces/msg/ParameterType, and the field of the value in
# rcl_interfaces/msg/ParameterValue.
_SCALAR_TYPES: Final = {
    bool: (1, "bool_value"),
    int: (2, "integer_value"),
    float: (3, "double_value"),
    str: (4, "string_value"),
}
# By the Python class of the elements: the same for lists.
_ARRAY_TYPES: Final = {
    bool: (6, "bool_array_value"),
    int: (7, "integer_array_value"),
    float: (8, "double_array_value"),
    str: (9, "string_array_value"),
}


def encode_value(value: ParameterValue) -> Message:
    """Return a value as rcl_interfaces/msg/ParameterValue."""
    if isinstance(value, list):
        # an empty list has no element that shows its type: any type of array would do
        type_number, field = _ARRAY_TYPES[type(value[0]) if value else str]
    else:
        type_number, field = _SCALAR_TYPES[type(value)]
    return {"type": type_number, field: value}


class Parameters(Closing):
    """The parameters of a node, with their services.

    :param node_name: the node's name without the slash.
    :param values: the values by the names of the parameters.
    :raises Ros2Error: if a number does not fit into 64 bits.
    """

    def __init__(
        self, node: Node, node_name: str, values: Mapping[str, ParameterValue], clock: Clock
    ) -> None:
        self._values = {key: encode_value(value) for key, value in values.items()}
        handlers: dict[str, Callable[[Message], Mapping[str, Any]]] = {
            "get_parameters": lambda request: self._describe_each(
                request, "values", lambda name: self._values[name]
            ),
            "get_parameter_types": lambda request: self._describe_each(
                request, "types", lambda name: self._values[name]["type"]
            ),
            "set_parameters": lambda request: _refuse_each(request, _READ_ONLY),
            "set_parameters_atomically": lambda request: _refuse_all(request, _READ_ONLY),
            "list_parameters": self._list_parameters,
            "describe_parameters": lambda request: self._describe_each(
                request,
                "descriptors",
                lambda name: {"name": name, "type": self._values[name]["type"], "read_only": True},
            ),
        }
        self._close_functions = [
            node.serve(
                f"/{node_name}/{service}",
                f"{_PACKAGE}/srv/{_to_camel_case(service)}",
                handler,
                right=right_of_frame("ros2-parameters", service),
                # services that only read are never refused
                make_refusal=_refuse_each if service == "set_parameters" else _refuse_all,
            )
            for service, handler in handlers.items()
        ]
        event_publisher = node.create_publisher(
            EVENTS_TOPIC, f"{_PACKAGE}/msg/ParameterEvent", PROFILES["parameters"]
        )
        self._close_functions.append(event_publisher.close)
        event_publisher.publish(
            {
                "stamp": us_to_stamp(clock.now_us()),
                "node": f"/{node_name}",
                "new_parameters": [{"name": key, "value": value} for key, value in self._values.items()],
            }
        )

    # --- services -----------------------------------------------------------------------------------------

    def _describe_each(
        self, request: Message, field: str, describe: Callable[[str], Any]
    ) -> Mapping[str, Any]:
        """Return a response with a description of each requested parameter.

        As in rclcpp, the response is empty if one of the parameters is unknown.

        :param field: the field of the response.
        :param describe: returns the description of a parameter, such as its value or its type.
        """
        names = request["names"]
        are_known = all(name in self._values for name in names)
        return {field: [describe(name) for name in names] if are_known else []}

    def _list_parameters(self, request: Message) -> Mapping[str, Any]:
        depth, prefixes = request["depth"], request["prefixes"]
        names = [name for name in self._values if _is_listed(name, prefixes, depth)]
        parents = dict.fromkeys(name.rpartition(_SEPARATOR)[0] for name in names if _SEPARATOR in name)
        return {"result": {"names": names, "prefixes": list(parents)}}

    def close(self) -> None:
        for close_endpoint in self._close_functions:
            close_endpoint()


def _refuse_each(request: Message, reason: str) -> Mapping[str, Any]:
    return {"results": [{"successful": False, "reason": reason} for _ in request["parameters"]]}


def _refuse_all(_request: Message, reason: str) -> Mapping[str, Any]:
    return {"result": {"successful": False, "reason": reason}}


def _to_camel_case(service: str) -> str:
    return "".join(word.capitalize() for word in service.split("_"))


def _is_listed(name: str, prefixes: Sequence[str], depth: int) -> bool:
    """Return whether ``list_parameters`` lists a parameter.

    :param prefixes: the names whose parameters are listed; empty for all names.
    :param depth: the maximum number of parts of a name after its prefix; 0 for any number (DEPTH_RECURSIVE).
    """
    paths = [
        name.removeprefix(prefix).removeprefix(_SEPARATOR)
        for prefix in prefixes or [""]
        if not prefix or name == prefix or name.startswith(prefix + _SEPARATOR)
    ]
    return any(depth == 0 or path.count(_SEPARATOR) < depth for path in paths)
