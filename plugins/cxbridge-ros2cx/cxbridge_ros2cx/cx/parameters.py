"""The parameters of the node ``clips_manager`` from a ROS 2 parameter file, each with its position.

A parameter file has ``NODE: ros__parameters: ...``; the name ``/**`` matches each node. The keys of nested
maps form the name of a parameter: ``files: {load: [...]}`` is the parameter ``files.load``.
"""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final, TypeVar

from msgspec import Struct

from cxbridge.config.documents import Mark, YamlList, YamlMap, YamlNode, YamlScalar, parse_documents
from cxbridge.errors import ConfigError
from cxbridge_ros2cx.parameters import YAML_FALSE, YAML_INTEGER, YAML_TRUE

NODE_NAME: Final = "clips_manager"

ENVIRONMENTS: Final = "environments"  # parameter with the names of the environments

_SECTION: Final = "ros__parameters"
# a number with or without a point and an exponent, infinity, or NaN
_FLOAT: Final = re.compile(r"[+-]?((\d+\.\d*|\.\d+|\d+)([eE][+-]?\d+)?|\.(inf|Inf|INF))\Z|\.(nan|NaN|NAN)\Z")

Scalar = bool | int | float | str
ParameterValue = Scalar | tuple[Scalar, ...]

_TYPE_NAMES: Final[dict[type, str]] = {bool: "a bool", int: "an integer", float: "a double", str: "a string"}

ScalarT = TypeVar("ScalarT", bound=Scalar)


class Parameter(Struct, frozen=True):
    """A parameter of a file.

    :param value: a scalar, or a tuple of scalars of one type.
    """

    value: ParameterValue
    mark: Mark


class NodeParameters:
    """The parameters of a node in a file.

    :param parameters: the parameters by name.
    :param name: the full name of the node.
    """

    def __init__(self, file: Path, parameters: Mapping[str, Parameter], name: str = f"/{NODE_NAME}") -> None:
        self.file = file
        self.name = name
        self._parameters = dict(parameters)

    @classmethod
    def load(cls, file: Path) -> NodeParameters:
        """Read the parameters of ``clips_manager`` from a file.

        :raises ConfigError: if the file is unreadable or not a parameter file.
        """
        try:
            yaml_bytes = file.read_bytes()
        except OSError as error:
            raise ConfigError(f"cannot read the parameters: {error.strerror}", file=file) from None
        sections = [
            section for root in parse_documents(yaml_bytes, str(file)) for section in _find_sections(root, "")
        ]
        name = f"/{NODE_NAME}"
        # a launch file may rename the node: the section with the parameter `environments` is its section
        manager_patterns = [
            pattern for pattern, parameter_map in sections if _has_environments(parameter_map)
        ]
        if not any(_matches_node(pattern, name) for pattern in manager_patterns):
            name = next((pattern for pattern in manager_patterns if "*" not in pattern), name)
        # later sections of a file override earlier ones
        parameters: dict[str, Parameter] = {}
        for pattern, parameter_map in sections:
            if _matches_node(pattern, name):
                parameters.update(_flatten(parameter_map, ""))
        return cls(file, parameters, name)

    def __iter__(self) -> Iterator[tuple[str, Parameter]]:
        """Yield names and parameters in the order of the file."""
        yield from self._parameters.items()

    def set_default(self, name: str, value: Scalar) -> None:
        """Set a parameter, unless the file has the parameter."""
        self._parameters.setdefault(name, Parameter(value, Mark(str(self.file))))

    def find(self, name: str) -> Parameter | None:
        return self._parameters.get(name)

    def get(self, name: str, default: ScalarT) -> ScalarT:
        """Return a parameter's value, which must have the type of the default.

        :raises ConfigError: if the parameter has another type.
        """
        parameter = self._parameters.get(name)
        if parameter is None:
            return default
        expected_type = type(default)
        if type(parameter.value) is not expected_type:
            raise self.make_error(
                name, f"must be {_TYPE_NAMES[expected_type]}, not {_describe_value(parameter.value)}"
            )
        return parameter.value

    def get_strings(self, name: str) -> tuple[str, ...]:
        """Return the strings of a list; empty if the parameter is missing.

        :raises ConfigError: if the parameter is not a list of strings.
        """
        parameter = self._parameters.get(name)
        values = () if parameter is None else parameter.value
        if not isinstance(values, tuple) or not all(isinstance(value, str) for value in values):
            raise self.make_error(name, f"must be a list of strings, not {_describe_value(values)}")
        return tuple(map(str, values))

    def make_error(self, name: str, fault: str, hint: str | None = None) -> ConfigError:
        """Return an error about a parameter, with its position."""
        return self.find_mark(name).error(f"the parameter '{name}' {fault}", hint)

    def find_mark(self, name: str) -> Mark:
        """Return the position of a parameter; without such a parameter, the file."""
        parameter = self._parameters.get(name)
        return Mark(str(self.file)) if parameter is None else parameter.mark


def _find_sections(content: YamlNode, path: str) -> Iterator[tuple[str, YamlMap]]:
    """Yield each node name or name pattern with its map of parameters.

    :param content: the YAML below the path.
    :raises ConfigError: if a node name is not a string, or the parameters are not a map.
    """
    if not isinstance(content, YamlMap):
        return
    for key, value in content.pairs:
        if not isinstance(key, YamlScalar):
            raise key.mark.error("the name of a node must be a string")
        if key.text != _SECTION:
            yield from _find_sections(value, f"{path}/{key.text.strip('/')}")
        elif isinstance(value, YamlMap):
            yield path, value
        elif not (isinstance(value, YamlScalar) and value.is_null):
            raise value.mark.error(f"{_SECTION} must be a map of parameters")


def _matches_node(pattern: str, name: str) -> bool:
    """Return whether a pattern matches a node's name: ``*`` matches one token, ``**`` any tokens."""
    if "**" in pattern:
        return fnmatch.fnmatchcase(name, pattern.replace("**", "*"))
    tokens, patterns = name.split("/"), pattern.split("/")
    return len(tokens) == len(patterns) and all(map(fnmatch.fnmatchcase, tokens, patterns))


def _has_environments(parameter_map: YamlMap) -> bool:
    return any(isinstance(key, YamlScalar) and key.text == ENVIRONMENTS for key, _ in parameter_map.pairs)


def _flatten(parameter_map: YamlMap, prefix: str) -> Iterator[tuple[str, Parameter]]:
    """Yield the parameters below a map, each with its full name.

    :raises ConfigError: if a name is not a string, or a value is empty or invalid.
    """
    for key, value in parameter_map.pairs:
        if not isinstance(key, YamlScalar):
            raise key.mark.error("the name of a parameter must be a string")
        name = f"{prefix}{key.text}"
        if isinstance(value, YamlMap):
            yield from _flatten(value, f"{name}.")
        elif isinstance(value, YamlList):
            yield name, Parameter(_read_list(name, value), value.mark)
        elif value.is_null:
            raise value.mark.error(
                f"the parameter '{name}' has no value", "give the value, or remove the line"
            )
        else:
            yield name, Parameter(_read_scalar(value), value.mark)


def _read_list(name: str, yaml_list: YamlList) -> tuple[Scalar, ...]:
    values: list[Scalar] = []
    for item in yaml_list.items:
        if not isinstance(item, YamlScalar):
            raise item.mark.error(f"the parameter '{name}' must be a list of scalars")
        values.append(_read_scalar(item))
        if type(values[-1]) is not type(values[0]):
            raise item.mark.error(
                f"the list '{name}' has values of several types: "
                f"{_describe_value(values[0])}, {_describe_value(values[-1])}",
                "the values of a list must be of one type in ROS; quote strings",
            )
    return tuple(values)


def _read_scalar(scalar: YamlScalar) -> Scalar:
    """Return the value as rcl_yaml_param_parser of ROS reads it: a quoted scalar is a string."""
    text, lower_text = scalar.text, scalar.text.lower()
    if not scalar.is_plain:
        return text
    if lower_text in YAML_TRUE or lower_text in YAML_FALSE:
        return lower_text in YAML_TRUE
    if YAML_INTEGER.match(text):
        return int(text, 16 if "x" in lower_text else 10)
    if _FLOAT.match(text):
        # Python writes infinity and NaN without the point of YAML
        return float(lower_text.replace(".inf", "inf").replace(".nan", "nan"))
    return text


def _describe_value(value: ParameterValue) -> str:
    if isinstance(value, tuple):
        return f"a list of {len(value)} values"
    return f"{_TYPE_NAMES[type(value)]} ({str(value).lower() if isinstance(value, bool) else value!r})"
