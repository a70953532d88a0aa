"""The base class of skill executors that are nodes of ROS 2: joining the domain, polling, time limits."""

from __future__ import annotations

import math
from collections.abc import Generator
from contextlib import closing
from dataclasses import replace
from typing import Any, ClassVar, Final, TypeVar, cast

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import ConfigError
from cxbridge.rights import ALL_RIGHTS
from cxbridge.skiller.board.executor import ExecutorContext, SkillExecutor, SkillFailedError
from cxbridge_ros2.node import Node
from cxbridge_ros2.settings import NODE_KEYS, NodeSettings, nest_settings

DEFAULT_TIMEOUT_S: Final = 600.0  # limit of a skill in seconds

StepT = TypeVar("StepT")
ValueT = TypeVar("ValueT")


class RosExecutor(SkillExecutor):
    """Executes skills as a node of ROS 2.

    :ivar settings: the settings of the executor as nested mappings.
    """

    known_settings: ClassVar[tuple[str, ...]] = (*NODE_KEYS, "skills")

    def __init__(self, context: ExecutorContext) -> None:
        # the skill board passes settings by path: skills/goto/name
        super().__init__(replace(context, settings=nest_settings(context.settings)))
        self.node_settings = NodeSettings.parse(self.settings, self.folder, type(self).__name__)
        # loaded here rather than in `join`, so that a missing package is an error when the run starts
        self._definitions = self.node_settings.load_definitions()
        self._node: Node | None = None

    def join(self) -> Node:
        """Join the domain as a node, which :meth:`close` closes.

        :raises Ros2Error: if the domain cannot be joined.
        """
        # all rights, since this node serves no requests of other nodes
        self._node = node = self.node_settings.join(
            f"cxbridge_{self.agent}", self._definitions, self.log.warn, ALL_RIGHTS
        )
        return node

    def idle(self) -> None:
        self.poll()

    def poll(self) -> None:
        if self._node is not None:
            self._node.poll()

    def close(self) -> None:
        if self._node is not None:
            self._node.close()

    def limit_time(
        self, limit_s: float, name: str, steps: Generator[StepT, None, ValueT]
    ) -> Generator[StepT, None, ValueT]:
        """Yield the steps of a skill and return its value, within a time limit.

        :param name: the name of the skill, for the error.
        :raises SkillFailedError: after the limit.
        """
        deadline_us = self.clock.now_us() + round(limit_s * MICROSECONDS)
        with closing(steps):  # the `finally` of the steps cancels the goal at once, not at garbage collection
            while self.clock.now_us() <= deadline_us:
                try:
                    yield next(steps)
                except StopIteration as end:
                    return cast("ValueT", end.value)  # the type checker does not know the type of end.value
        raise SkillFailedError(f"{name} has not ended within {limit_s:g} s")


def parse_seconds(skill: str, key: str, value: Any) -> float:
    """Return the setting of a skill as seconds.

    :raises ConfigError: if the value is not a positive number.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
        raise ConfigError(
            f"the {key} of the skill {skill} must be a positive number of seconds, not {value!r}"
        )
    return float(value)
