"""Parameters of a node that clients can read and set: six services and the topic /parameter_events.

A parameter has a declared type, which clients cannot change.
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
from cxbridge_ros2.stamps import stamp_of

# The value of a parameter; None before it is set.
Value: TypeAlias = bool | int | float | str | bytes | list[bool] | list[int] | list[float] | list[str] | None

EVENTS: Final = "/parameter_events"
_PACKAGE: Final = "rcl_interfaces"
_SEPARATOR: Final = "."
_INT64: Final = 2**63  # ROS has 64-bit integers, Python any


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


_FIELDS: Final = {
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
# Types of a scalar, and of an array of such scalars.
_TYPES: Final = {
    bool: (ParameterType.BOOL, ParameterType.BOOL_ARRAY),
    int: (ParameterType.INTEGER, ParameterType.INTEGER_ARRAY),
    float: (ParameterType.DOUBLE, ParameterType.DOUBLE_ARRAY),
    str: (ParameterType.STRING, ParameterType.STRING_ARRAY),
}


def type_of(value: Value) -> ParameterType:
    """Return the type of a value.

    :raises Ros2Error: for a list of several types, or a number beyond 64 bits.
    """
    if value is None:
        return ParameterType.NOT_SET
    if isinstance(value, bytes):
        return ParameterType.BYTE_ARRAY
    is_list = isinstance(value, list)
    elements = value if isinstance(value, list) else [value]
    if any(type(element) is int and not -_INT64 <= element < _INT64 for element in elements):
        raise Ros2Error(f"a number does not fit into 64 bits: {value}")
    kinds = {type(element) for element in elements}
    if len(kinds) > 1:
        raise Ros2Error(f"a list has values of one type: {value}")
    # an empty list has no element that shows its type
    return _TYPES[kinds.pop()][is_list] if kinds else ParameterType.STRING_ARRAY


def message_of(value: Value) -> Mapping[str, Any]:
    """Return a value as rcl_interfaces/msg/ParameterValue."""
    kind = type_of(value)
    field = _FIELDS.get(kind)
    if field is None:
        return {"type": int(kind)}
    return {"type": int(kind), field: list(value) if isinstance(value, bytes) else value}


def value_of(message: Mapping[str, Any]) -> Value:
    """Return the value in an rcl_interfaces/msg/ParameterValue."""
    kind = message["type"]
    if kind not in list(ParameterType):
        raise Ros2Error(f"there is no type {kind} of parameters")
    field = _FIELDS.get(ParameterType(kind))
    if field is None:
        return None
    value: Any = message[field]
    if kind == ParameterType.BYTE_ARRAY:
        return bytes(value)
    return list(value) if isinstance(value, Sequence) and not isinstance(value, str) else value


@dataclass(slots=True)
class Parameter:
    """A declared parameter.

    :param read_only: whether clients cannot set the parameter.
    """

    value: Value
    description: str = ""
    read_only: bool = False


class Parameters(Closing):
    """The parameters of a node, with their services.

    :param name: the node's name without the slash.
    :param declared: parameters by name; their types never change.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        declared: Mapping[str, Parameter],
        clock: Clock,
    ) -> None:
        self._name, self._clock = name, clock
        self._declared = dict(declared)
        self._types = {key: type_of(parameter.value) for key, parameter in declared.items()}
        handlers: dict[str, Callable[[Message], Mapping[str, Any]]] = {
            "get_parameters": self._get,
            "get_parameter_types": self._get_types,
            "set_parameters": self._set,
            "set_parameters_atomically": self._set_atomically,
            "list_parameters": self._list,
            "describe_parameters": self._describe,
        }
        self._closers = [
            node.serve(
                f"/{name}/{service}",
                f"{_PACKAGE}/srv/{_camel(service)}",
                handler,
                needs=right_of_frame("ros2-parameters", service),
                refuse=_refusal_of_each if service == "set_parameters" else _refusal_of_all,
            )
            for service, handler in handlers.items()
        ]
        self._events = node.publisher(EVENTS, f"{_PACKAGE}/msg/ParameterEvent", PROFILES["parameters"])
        self._publish_event("new_parameters", self._declared)

    def __getitem__(self, name: str) -> Value:
        return self._declared[name].value

    # --- services -----------------------------------------------------------------------------------------

    def _get(self, request: Message) -> Mapping[str, Any]:
        return self._answer_each(request, "values", lambda name: message_of(self[name]))

    def _get_types(self, request: Message) -> Mapping[str, Any]:
        return self._answer_each(request, "types", lambda name: int(type_of(self[name])))

    def _describe(self, request: Message) -> Mapping[str, Any]:
        return self._answer_each(
            request,
            "descriptors",
            lambda name: {
                "name": name,
                "type": int(self._types[name]),
                "description": self._declared[name].description,
                "read_only": self._declared[name].read_only,
            },
        )

    def _answer_each(self, request: Message, field: str, describe: Callable[[str], Any]) -> Mapping[str, Any]:
        """Return data of each requested parameter; as in ROS, nothing if a parameter is unknown."""
        names = request["names"]
        are_known = all(name in self._declared for name in names)
        return {field: [describe(name) for name in names] if are_known else []}

    def _list(self, request: Message) -> Mapping[str, Any]:
        depth, prefixes = request["depth"], request["prefixes"]
        names = [name for name in self._declared if _is_listed(name, prefixes, depth)]
        parents = dict.fromkeys(name.rpartition(_SEPARATOR)[0] for name in names if _SEPARATOR in name)
        return {"result": {"names": names, "prefixes": list(parents)}}

    def _set(self, request: Message) -> Mapping[str, Any]:
        results = []
        # one after the other: a refused value does not stop the following ones
        for parameter in request["parameters"]:
            reason = self._why_refused(parameter)
            results.append({"successful": not reason, "reason": reason})
            if not reason:
                self._store_values([parameter])
        return {"results": results}

    def _set_atomically(self, request: Message) -> Mapping[str, Any]:
        parameters = request["parameters"]
        reason = next(filter(None, map(self._why_refused, parameters)), "")
        if not reason:
            self._store_values(parameters)
        return {"result": {"successful": not reason, "reason": reason}}

    def _why_refused(self, message: Message) -> str:
        """Return why a parameter cannot be set; empty if the parameter can be set."""
        name = message["name"]
        parameter = self._declared.get(name)
        if parameter is None:
            return f"there is no parameter '{name}'"
        if parameter.read_only:
            return f"the parameter '{name}' is read-only"
        try:
            value = value_of(message["value"])
        except Ros2Error as error:
            return error.message
        declared_type, kind = self._types[name], type_of(value)
        if kind is not declared_type and declared_type is not ParameterType.NOT_SET:
            return f"the parameter '{name}' is of type {declared_type.name}, not {kind.name}"
        return ""

    def _store_values(self, messages: Sequence[Message]) -> None:
        for message in messages:
            self._declared[message["name"]].value = value_of(message["value"])
        self._publish_event("changed_parameters", [message["name"] for message in messages])

    def _publish_event(self, field: str, names: Iterable[str]) -> None:
        parameters = [{"name": name, "value": message_of(self[name])} for name in names]
        stamp = stamp_of(self._clock.now_us())
        self._events.publish({"stamp": stamp, "node": f"/{self._name}", field: parameters})

    def close(self) -> None:
        for end in self._closers:
            end()
        self._events.close()


def _refusal_of_each(request: Message, reason: str) -> Mapping[str, Any]:
    return {"results": [{"successful": False, "reason": reason} for _ in request["parameters"]]}


def _refusal_of_all(_request: Message, reason: str) -> Mapping[str, Any]:
    return {"result": {"successful": False, "reason": reason}}


def _camel(service: str) -> str:
    return "".join(word.capitalize() for word in service.split("_"))


def _is_listed(name: str, prefixes: Sequence[str], depth: int) -> bool:
    """Return whether a name equals a prefix or is below it, within the requested depth."""
    paths = [
        name.removeprefix(prefix).removeprefix(_SEPARATOR)
        for prefix in prefixes or [""]
        if not prefix or name == prefix or name.startswith(prefix + _SEPARATOR)
    ]
    return any(depth == 0 or path.count(_SEPARATOR) < depth for path in paths)
