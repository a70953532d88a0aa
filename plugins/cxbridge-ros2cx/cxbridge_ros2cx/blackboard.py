"""The original's feature ``blackboard``, on our blackboard.

Its template ``blackboard-interface`` has no hash and no serial, and facts of interfaces live for one run of
the rules (``retract-early``). It registers five functions, of which reading does nothing; the only interface
that it knows is a ROS message. The remaining functions of Fawkes' feature exist, but commented out. By
default all functions are defined and work; in the mode ``original`` there are those five. Source:
BlackboardFeature.cpp.
"""

from __future__ import annotations

from typing import Final

from cxbridge.blackboard import BlackBoard
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.udf import Function

ORIGINAL_FUNCTIONS: Final = frozenset(
    {
        "blackboard-enable-time-read",
        "blackboard-open",
        "blackboard-open-reading",
        "blackboard-read",
        "blackboard-create-msg",
    }
)
"""The functions that the original registers."""


class Ros2CxBlackboardFeature(BlackBoardFeature):
    """Gives the ``blackboard-*`` functions.

    :param name: the name of the feature in the configuration.
    :param board: the blackboard that environments see.
    :param original: define only :data:`ORIGINAL_FUNCTIONS`, and let reading do nothing.
    """

    def __init__(self, name: str, board: BlackBoard, *, original: bool = False) -> None:
        super().__init__(board, retract_early=True)
        self.name = name
        self._original = original

    def _define(
        self, env: ClipsEnvironment, name: str, function: Function, minimum: int = 0, types: str = "*"
    ) -> None:
        if not self._original:
            super()._define(env, name, function, minimum, types)
        elif name in ORIGINAL_FUNCTIONS:
            does = _read_nothing if name == "blackboard-read" else function
            super()._define(env, name, does, minimum, types)


def _read_nothing() -> None:
    pass
