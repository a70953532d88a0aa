"""``cx::RosParamPlugin``: reads parameters of the node in rules."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import FALSE, TRUE, Value
from cxbridge_ros2cx.cx.parameters import Scalar
from cxbridge_ros2cx.cx.plugin import CxPlugin

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

# parameters that the original's node itself declares, with its defaults, which rules see. CxNode.init has
# the default of the original's launch file.
_DEFAULTS: Final[dict[str, Scalar]] = {"autostart_node": False, "bond_heartbeat_period": 0.0}

_BOOLS: Final = frozenset({"TRUE", "FALSE"})


class RosParamPlugin(CxPlugin):
    """Defines ``ros-param-get-value``."""

    def initialize(self) -> None:
        """Start with the declared parameters of the node."""
        self._declared: dict[str, Scalar | tuple[Scalar, ...]] = dict(_DEFAULTS)

    def init_context(self, env: ClipsEnvironment) -> None:
        # any result; the name as SYMBOL or STRING, a default of any type
        env.define("ros-param-get-value", self._get, 2, types="*;sy;*")

    def _get(self, name: str, default: Value) -> Value:
        """Return a parameter's value and declare it with the type of its default."""
        parameter = self.parameters.find(str(name))
        default_value = _ros_value(default)
        value = self._declared.get(str(name), default_value) if parameter is None else parameter.value
        self._declared[str(name)] = value
        if not _has_same_type(value, default_value):
            raise ClipsError(f"the parameter '{name}' is {value!r}: its type is not that of the default")
        return _clips_value(value)


def _ros_value(value: Value) -> Scalar | tuple[Scalar, ...]:
    if isinstance(value, tuple):
        kinds = {type(_ros_value(element)) for element in value}
        if len(kinds) > 1:
            raise ClipsError("the values of a list must be of one type")
        # CLIPS has no nested multifields: the test only tells the type checker so
        return tuple(element for element in map(_ros_value, value) if not isinstance(element, tuple))
    if isinstance(value, str):
        # as in the original, the STRING "TRUE" is a bool, too
        return value == "TRUE" if value in _BOOLS else str(value)
    if isinstance(value, int | float):
        return value
    raise ClipsError(f"a parameter cannot be {value!r}")


def _has_same_type(value: Scalar | tuple[Scalar, ...], default: Scalar | tuple[Scalar, ...]) -> bool:
    if isinstance(value, tuple) and isinstance(default, tuple):
        default = default or ("",)  # as in the original, an empty list is a list of strings
        return not value or type(value[0]) is type(default[0])
    return type(value) is type(default)


def _clips_value(value: Scalar | tuple[Scalar, ...]) -> Value:
    if isinstance(value, tuple):
        return tuple(map(_clips_value, value))
    if isinstance(value, bool):
        return TRUE if value else FALSE
    return value
