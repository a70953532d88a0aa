"""The plug-in ``cx::RosParamPlugin``: rules read parameters of the node.

As in ROS, the first read of a parameter declares the parameter with a default, which determines its type.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import FALSE, TRUE, Value
from cxbridge_ros2cx.cx.parameters import ParameterValue, Scalar
from cxbridge_ros2cx.cx.plugin import CxPlugin

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

# The parameters that the node of the ROS 2 CX declares itself, with the defaults that rules see. CxNode.init
# has another default of `autostart_node`: that of the launch file.
_DECLARED_DEFAULTS: Final[dict[str, Scalar]] = {"autostart_node": False, "bond_heartbeat_period": 0.0}

_BOOL_WORDS: Final = frozenset({"TRUE", "FALSE"})


class RosParamPlugin(CxPlugin):
    """Defines ``ros-param-get-value``."""

    def initialize(self) -> None:
        """Start with the declared parameters of the node."""
        self._declared_values: dict[str, ParameterValue] = dict(_DECLARED_DEFAULTS)

    def init_context(self, env: ClipsEnvironment) -> None:
        # any result; the name as SYMBOL or STRING, a default of any type
        env.define("ros-param-get-value", self._get_parameter, 2, types="*;sy;*")

    def _get_parameter(self, name: str, default: Value) -> Value:
        """Return a parameter's value; the first call for a parameter declares it.

        :raises ClipsError: if the parameter has another type than the default, or ROS has no such default.
        """
        parameter = self.parameters.find(str(name))
        default_value = _to_ros_value(default)
        value = self._declared_values.get(str(name), default_value) if parameter is None else parameter.value
        self._declared_values[str(name)] = value
        if not _has_same_type(value, default_value):
            raise ClipsError(f"the parameter '{name}' is {value!r}: its type is not that of the default")
        return _to_clips_value(value)


def _to_ros_value(value: Value) -> ParameterValue:
    """Return the parameter value for a CLIPS value.

    :raises ClipsError: if ROS parameters have no such value.
    """
    if isinstance(value, tuple):
        element_types = {type(_to_ros_value(element)) for element in value}
        if len(element_types) > 1:
            raise ClipsError("the values of a list must be of one type")
        # CLIPS has no nested multifields: the check is for the type checker
        return tuple(element for element in map(_to_ros_value, value) if not isinstance(element, tuple))
    if isinstance(value, str):
        # as in the ROS 2 CX, the STRING "TRUE" is a bool, too
        return value == "TRUE" if value in _BOOL_WORDS else str(value)
    if isinstance(value, int | float):
        return value
    raise ClipsError(f"a parameter cannot be {value!r}")


def _has_same_type(value: ParameterValue, default: ParameterValue) -> bool:
    if isinstance(value, tuple) and isinstance(default, tuple):
        default = default or ("",)  # as in the ROS 2 CX, an empty default is a list of strings
        return not value or type(value[0]) is type(default[0])  # an empty value has no type that could differ
    return type(value) is type(default)


def _to_clips_value(value: ParameterValue) -> Value:
    if isinstance(value, tuple):
        return tuple(map(_to_clips_value, value))
    if isinstance(value, bool):
        return TRUE if value else FALSE
    return value
