"""The configuration of experts: ``/ros2/experts``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from msgspec import Struct

from cxbridge.errors import ConfigError
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.executor import NodeSettings
from cxbridge_ros2.experts.names import NODES
from cxbridge_ros2.trees import node_settings, placed

if TYPE_CHECKING:
    from cxbridge.config import Configuration

TREE: Final = "/ros2/experts"
ALL: Final = "all"

_WHOSE: Final = "the settings of the experts"


class ExpertSettings(Struct, frozen=True):
    """The settings of experts.

    :param serve: keys of :data:`~cxbridge_ros2.experts.names.NODES`.
    """

    serve: tuple[str, ...]
    node: NodeSettings

    @classmethod
    def of(cls, config: Configuration, folder: Path) -> ExpertSettings:
        """Read the settings.

        :param folder: the base of relative paths.
        :raises CxbridgeError: if a setting is invalid; with file and line.
        """
        values, node = node_settings(config, TREE, ("serve",), folder, _WHOSE)
        serve = values.get("serve", ALL)
        names = [str(each) for each in serve] if isinstance(serve, list) else [str(serve)]
        with placed(config, TREE):
            for name in names:
                if name not in (ALL, *NODES):
                    hint = did_you_mean(name, (ALL, *NODES), f"there are: {', '.join((*NODES, ALL))}")
                    raise ConfigError(f"{_WHOSE}: '{name}' is no service", hint=hint)
            if not names:
                raise ConfigError(f"{_WHOSE}: nothing is served", hint="serve: all")
        return cls(tuple(NODES) if ALL in names else tuple(dict.fromkeys(names)), node)
