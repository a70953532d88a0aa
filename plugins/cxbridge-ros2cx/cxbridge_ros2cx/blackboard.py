"""The feature ``blackboard`` of the thesis' executive, on the blackboard of cxbridge.

In the thesis' executive, ros2-clips-executive (2021), the template ``blackboard-interface`` has neither hash
nor serial, and interface facts live for one run of the rules (``retract-early``). The executive registers
five functions: the function for reading does nothing, and a ROS message is the only known interface. The
remaining functions of Fawkes' feature are commented out there. Here all functions work by default; the mode
``original`` defines only those five. Source: BlackboardFeature.cpp.
"""

from __future__ import annotations

from typing import Final

from cxbridge.blackboard import BlackBoard
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.udf import Function

# the functions that the thesis' executive registers
THESIS_FUNCTIONS: Final = frozenset(
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
    :param repeats_defects: whether to define only :data:`THESIS_FUNCTIONS`, with a ``blackboard-read`` that
        does nothing.
    """

    def __init__(self, board: BlackBoard, name: str, *, repeats_defects: bool = False) -> None:
        super().__init__(board, retract_early=True)
        self.name = name
        self._repeats_defects = repeats_defects

    def _define(
        self, env: ClipsEnvironment, name: str, function: Function, minimum: int = 0, types: str = "*"
    ) -> None:
        if not self._repeats_defects:
            super()._define(env, name, function, minimum, types)
        elif name in THESIS_FUNCTIONS:
            implementation = (lambda: None) if name == "blackboard-read" else function
            super()._define(env, name, implementation, minimum, types)
