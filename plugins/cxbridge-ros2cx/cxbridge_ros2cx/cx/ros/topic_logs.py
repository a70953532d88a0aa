"""The log lines of environments as messages on a topic, as of pull request 33 (June 2026)."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from cxbridge.executive.host.loggers import ClipsLogger
from cxbridge.rights import Right
from cxbridge_ros2cx.cx.stock import StockOutput

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cxbridge.events import Level
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_ros2.messages import Message
    from cxbridge_ros2cx.cx.manager import CxManager

_LOGGER: Final = "topic"


class TopicLogs:
    """Publishes the lines of the environments that a parameter or a peer has selected.

    :param name: the full name of the node.
    """

    def __init__(self, manager: CxManager, name: str) -> None:
        self._manager, node = manager, manager.context.ros.node
        self._publisher = node.publisher(f"{name}/clips_log", "cx_msgs/msg/Log")
        self.end: Callable[[], None] = node.serve(
            f"{name}/set_topic_logging", "cx_msgs/srv/SetTopicLogging", self._set, needs=Right.CONTROL
        )
        for env in manager.environments:
            if manager.context.parameters.get(f"{env}.log_clips_to_topic", default=False):
                self._switch(env, on=True)

    def _set(self, request: Message) -> Mapping[str, Any]:
        self._switch(request["env_name"], on=request["enabled"])
        return {"success": True}

    def _switch(self, name: str, *, on: bool) -> None:
        env = self._manager.environments.get(name)
        if env is None:
            return
        if any(logger.name == _LOGGER for logger in env.loggers.loggers):
            env.loggers.remove(_LOGGER)
        if on:
            env.loggers.add(ClipsLogger(_LOGGER, partial(self._publish, env), component=name))

    def _publish(self, env: ClipsEnvironment, _level: Level, line: str) -> None:
        logical_name = env.output.logical_name if isinstance(env.output, StockOutput) else ""
        self._publisher.publish({"env_name": env.name, "logical_name": logical_name, "line": line})
