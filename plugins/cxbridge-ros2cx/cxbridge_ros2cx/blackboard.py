"""The feature ``blackboard`` of ros2-clips-executive (2021), the original, on the blackboard of cxbridge.

The original's template ``blackboard-interface`` has neither hash nor serial, and interface facts live for one
run of the rules (``retract-early``). The original registers five functions: the function for reading does
nothing, and a ROS message is the only known interface. The other functions of Fawkes' feature are commented
out in the original. By default all functions work; the mode ``original`` keeps those five. Source:
BlackboardFeature.cpp.
"""

from __future__ import annotations

from typing import Final

from cxbridge.blackboard import BlackBoard
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.udf import Function

# The functions that the original registers.
ORIGINAL_FUNCTIONS: Final = frozenset(
    {
        "blackboard-enable-time-read",
        "blackboard-open",
        "blackboard-open-reading",
        "blackboard-read",
        "blackboard-create-msg",
    }
)


class Ros2CxBlackboardFeature(BlackBoardFeature):
    """Defines the ``blackboard-*`` functions.

    :param board: the blackboard of the environments.
    :param name: the name of the feature in the configuration.
    :param original: whether to define only :data:`ORIGINAL_FUNCTIONS`, with a reading function that does
        nothing.
    """

    def __init__(self, board: BlackBoard, name: str, *, original: bool = False) -> None:
        super().__init__(board, retract_early=True)
        self.name = name
        self._original = original

    def _define(
        self, env: ClipsEnvironment, name: str, function: Function, minimum: int = 0, types: str = "*"
    ) -> None:
        if not self._original:
            super()._define(env, name, function, minimum, types)
        elif name in ORIGINAL_FUNCTIONS:
            implementation = (lambda: None) if name == "blackboard-read" else function
            super()._define(env, name, implementation, minimum, types)
