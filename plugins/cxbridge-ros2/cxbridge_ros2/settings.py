"""The part of a configuration that is for nodes of ROS 2, as its rights see it."""

from __future__ import annotations

from typing import ClassVar, Self

from cxbridge.config import Configuration
from cxbridge.run.plugin_settings import PluginSettings
from cxbridge_ros2.trees import nodes_stay_here


class NodesSettings(PluginSettings):
    """Whether only nodes of this machine reach the nodes of a configuration.

    :param is_local: whether the nodes are for this machine only.
    """

    SECTION: ClassVar[str] = "/ros2"
    in_runs: ClassVar[bool] = True

    def __init__(self, *, is_local: bool) -> None:
        self._is_local = is_local

    @classmethod
    def read(cls, config: Configuration) -> Self | None:
        """Return the settings; None for a configuration without nodes."""
        return cls(is_local=nodes_stay_here(config)) if config.keys(cls.SECTION) else None

    @property
    def is_local(self) -> bool:
        """Whether the nodes are for this machine only."""
        return self._is_local
