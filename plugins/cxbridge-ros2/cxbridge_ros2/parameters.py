"""The parameters of a node, which clients read and set: six services, and the topic /parameter_events.

A parameter is declared with a value, whose type clients cannot change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Final, TypeAlias

from cxbridge.clock import Clock
from cxbridge.closing import Closing
from cxbridge.errors import Ros2Error
from cxbridge.rights import right_of_frame
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Node
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.stamps import us_to_stamp

# The value of a parameter; None before it is set.
ParameterValue: TypeAlias = (
    bool | int | float | str | bytes | list[bool] | list[int] | list[float] | list[str] | None
)

EVENTS_TOPIC: Final = "/parameter_events"
_PACKAGE: Final = "rcl_interfaces"
_SEPARATOR: Final = "."
_INT64_LIMIT: Final = 2**63  # integers of parameters have 64 bits, those of Python have no limit


class ParameterType(IntEnum):
    """rcl_interfaces/msg/ParameterType."""

    NOT_SET = 0
    BOOL = 1
    INTEGER = 2
    DOUBLE = 3
    STRING = 4
    BYTE_ARRAY = 5
    BOOL_ARRAY = 6
    INTEGER_ARRAY = 7
    DOUBLE_ARRAY = 8
    STRING_ARRAY = 9


_VALUE_FIELDS: Final = {
    ParameterType.BOOL: "bool_value",
    ParameterType.INTEGER: "integer_value",
    ParameterType.DOUBLE: "double_value",
    ParameterType.STRING: "string_value",
    ParameterType.BYTE_ARRAY: "byte_array_value",
    ParameterType.BOOL_ARRAY: "bool_array_value",
    ParameterType.INTEGER_ARRAY: "integer_array_value",
    ParameterType.DOUBLE_ARRAY: "double_array_value",
    ParameterType.STRING_ARRAY: "string_array_value",
}
# By Python class: the parameter types of a scalar, and of a list of such scalars.
_TYPES_BY_CLASS: Final = {
    bool: (ParameterType.BOOL, ParameterType.BOOL_ARRAY),
    int: (ParameterType.INTEGER, ParameterType.INTEGER_ARRAY),
    float: (ParameterType.DOUBLE, ParameterType.DOUBLE_ARRAY),
    str: (ParameterType.STRING, ParameterType.STRING_ARRAY),
}


def find_parameter_type(value: ParameterValue) -> ParameterType:
    """Return the type of a value.

    :raises Ros2Error: for a list of several types, or a number beyond 64 bits.
    """
    if value is None:
        return ParameterType.NOT_SET
    if isinstance(value, bytes):
        return ParameterType.BYTE_ARRAY
    is_list = isinstance(value, list)
    elements = value if isinstance(value, list) else [value]
    if any(type(element) is int and not -_INT64_LIMIT <= element < _INT64_LIMIT for element in elements):
        raise Ros2Error(f"a number does not fit into 64 bits: {value}")
    classes = {type(element) for element in elements}
    if len(classes) > 1:
        raise Ros2Error(f"the values of a list must be of one type, unlike {value}")
    # an empty list has no element that shows its type: any type of array would do
    return _TYPES_BY_CLASS[classes.pop()][is_list] if classes else ParameterType.STRING_ARRAY


def encode_value(value: ParameterValue) -> Mapping[str, Any]:
    """Return a value as rcl_interfaces/msg/ParameterValue."""
    value_type = find_parameter_type(value)
    field = _VALUE_FIELDS.get(value_type)
    if field is None:
        return {"type": int(value_type)}
    return {"type": int(value_type), field: list(value) if isinstance(value, bytes) else value}


def decode_value(message: Mapping[str, Any]) -> ParameterValue:
    """Return the value in an rcl_interfaces/msg/ParameterValue.

    :raises Ros2Error: if the message has an unknown type.
    """
    type_number = message["type"]
    if type_number not in list(ParameterType):
        raise Ros2Error(f"unknown parameter type {type_number}")
    field = _VALUE_FIELDS.get(ParameterType(type_number))
    if field is None:
        return None
    value: Any = message[field]
    if type_number == ParameterType.BYTE_ARRAY:
        return bytes(value)
    return list(value) if isinstance(value, Sequence) and not isinstance(value, str) else value


@dataclass(slots=True)
class Parameter:
    """A declared parameter.

    :param read_only: whether clients cannot set the parameter.
    """

    value: ParameterValue
    description: str = ""
    read_only: bool = False


class Parameters(Closing):
    """The parameters of a node, with their services.

    :param name: the node's name without the slash.
    :param parameters_by_name: parameters by name; their types never change.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        parameters_by_name: Mapping[str, Parameter],
        clock: Clock,
    ) -> None:
        self._name, self._clock = name, clock
        self._parameters = dict(parameters_by_name)
        self._types = {
            key: find_parameter_type(parameter.value) for key, parameter in parameters_by_name.items()
        }
        handlers: dict[str, Callable[[Message], Mapping[str, Any]]] = {
            "get_parameters": self._get_parameters,
            "get_parameter_types": self._get_parameter_types,
            "set_parameters": self._set_parameters,
            "set_parameters_atomically": self._set_parameters_atomically,
            "list_parameters": self._list_parameters,
            "describe_parameters": self._describe_parameters,
        }
        self._close_functions = [
            node.serve(
                f"/{name}/{service}",
                f"{_PACKAGE}/srv/{_to_camel_case(service)}",
                handler,
                right=right_of_frame("ros2-parameters", service),
                make_refusal=_refuse_each if service == "set_parameters" else _refuse_all,
            )
            for service, handler in handlers.items()
        ]
        self._event_publisher = node.create_publisher(
            EVENTS_TOPIC, f"{_PACKAGE}/msg/ParameterEvent", PROFILES["parameters"]
        )
        self._publish_event("new_parameters", self._parameters)

    def __getitem__(self, name: str) -> ParameterValue:
        return self._parameters[name].value

    # --- services -----------------------------------------------------------------------------------------

    def _get_parameters(self, request: Message) -> Mapping[str, Any]:
        return self._describe_each(request, "values", lambda name: encode_value(self[name]))

    def _get_parameter_types(self, request: Message) -> Mapping[str, Any]:
        return self._describe_each(request, "types", lambda name: int(find_parameter_type(self[name])))

    def _describe_parameters(self, request: Message) -> Mapping[str, Any]:
        return self._describe_each(
            request,
            "descriptors",
            lambda name: {
                "name": name,
                "type": int(self._types[name]),
                "description": self._parameters[name].description,
                "read_only": self._parameters[name].read_only,
            },
        )

    def _describe_each(
        self, request: Message, field: str, describe: Callable[[str], Any]
    ) -> Mapping[str, Any]:
        """Return a response with data of each requested parameter.

        As in rclcpp, the response is empty if one of the parameters is unknown.

        :param field: the field of the response.
        :param describe: returns the data of a parameter.
        """
        names = request["names"]
        are_known = all(name in self._parameters for name in names)
        return {field: [describe(name) for name in names] if are_known else []}

    def _list_parameters(self, request: Message) -> Mapping[str, Any]:
        depth, prefixes = request["depth"], request["prefixes"]
        names = [name for name in self._parameters if _is_listed(name, prefixes, depth)]
        parents = dict.fromkeys(name.rpartition(_SEPARATOR)[0] for name in names if _SEPARATOR in name)
        return {"result": {"names": names, "prefixes": list(parents)}}

    def _set_parameters(self, request: Message) -> Mapping[str, Any]:
        results = []
        # in a loop: a refused parameter does not keep the following parameters from being set
        for parameter in request["parameters"]:
            reason = self._find_refusal_reason(parameter)
            results.append({"successful": not reason, "reason": reason})
            if not reason:
                self._store_values([parameter])
        return {"results": results}

    def _set_parameters_atomically(self, request: Message) -> Mapping[str, Any]:
        parameters = request["parameters"]
        reason = next(filter(None, map(self._find_refusal_reason, parameters)), "")
        if not reason:
            self._store_values(parameters)
        return {"result": {"successful": not reason, "reason": reason}}

    def _find_refusal_reason(self, message: Message) -> str:
        """Return why a parameter cannot be set; empty if the parameter can be set."""
        name = message["name"]
        parameter = self._parameters.get(name)
        if parameter is None:
            return f"there is no parameter '{name}'"
        if parameter.read_only:
            return f"the parameter '{name}' is read-only"
        try:
            value = decode_value(message["value"])
        except Ros2Error as error:
            return error.message
        declared_type, value_type = self._types[name], find_parameter_type(value)
        if value_type is not declared_type and declared_type is not ParameterType.NOT_SET:
            return f"the parameter '{name}' is of type {declared_type.name}, not {value_type.name}"
        return ""

    def _store_values(self, messages: Sequence[Message]) -> None:
        for message in messages:
            self._parameters[message["name"]].value = decode_value(message["value"])
        self._publish_event("changed_parameters", [message["name"] for message in messages])

    def _publish_event(self, field: str, names: Iterable[str]) -> None:
        parameters = [{"name": name, "value": encode_value(self[name])} for name in names]
        stamp = us_to_stamp(self._clock.now_us())
        self._event_publisher.publish({"stamp": stamp, "node": f"/{self._name}", field: parameters})

    def close(self) -> None:
        for end_service in self._close_functions:
            end_service()
        self._event_publisher.close()


def _refuse_each(request: Message, reason: str) -> Mapping[str, Any]:
    return {"results": [{"successful": False, "reason": reason} for _ in request["parameters"]]}


def _refuse_all(_request: Message, reason: str) -> Mapping[str, Any]:
    return {"result": {"successful": False, "reason": reason}}


def _to_camel_case(service: str) -> str:
    return "".join(word.capitalize() for word in service.split("_"))


def _is_listed(name: str, prefixes: Sequence[str], depth: int) -> bool:
    """Return whether ``list_parameters`` lists a parameter.

    :param prefixes: the names whose parameters are listed; empty for all names.
    :param depth: the maximum number of further parts of a name; 0 for any number (DEPTH_RECURSIVE).
    """
    paths = [
        name.removeprefix(prefix).removeprefix(_SEPARATOR)
        for prefix in prefixes or [""]
        if not prefix or name == prefix or name.startswith(prefix + _SEPARATOR)
    ]
    return any(depth == 0 or path.count(_SEPARATOR) < depth for path in paths)
