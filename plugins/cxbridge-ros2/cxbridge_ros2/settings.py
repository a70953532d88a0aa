"""The configuration section of ROS 2 nodes, for the check of rights."""

from __future__ import annotations

from typing import ClassVar, Self

from cxbridge.config import Configuration
from cxbridge.run.plugin_settings import PluginSettings
from cxbridge_ros2.trees import nodes_stay_here


class NodesSettings(PluginSettings):
    """The reach of the nodes in a configuration.

    :param is_local: whether only nodes of this machine can reach them.
    """

    SECTION: ClassVar[str] = "/ros2"
    in_runs: ClassVar[bool] = True

    def __init__(self, *, is_local: bool) -> None:
        self._is_local = is_local

    @classmethod
    def read(cls, config: Configuration) -> Self | None:
        return cls(is_local=nodes_stay_here(config)) if config.keys(cls.SECTION) else None

    @property
    def is_local(self) -> bool:
        return self._is_local
