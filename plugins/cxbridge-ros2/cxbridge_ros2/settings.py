"""Configuration sections with settings of nodes, such as ``/ros2/node``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.skiller.board.settings import value_of
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2.executor import OF_NODE, NodeSettings
from cxbridge_ros2.fawkes_keys import has_ours, is_ours

if TYPE_CHECKING:
    from cxbridge.config import Configuration

_ROS2: Final = "/ros2"
_OF_SEVERAL: Final = ("interfaces", "performers")  # sections with a node per key
_ASKS: Final = ("clock",)  # sections whose nodes serve no requests


def values_below(config: Configuration, tree: str) -> dict[str, Any]:
    """Return the values below a path by relative path, without those of Fawkes' plug-ins."""
    values: dict[str, Any] = {}
    for value in config.search(f"{tree}/"):
        key = value.path.removeprefix(f"{tree}/")
        if is_ours(tree, key):
            values[key] = [value_of(text) for text in value.items] if value.is_list else value_of(value.text)
    return values


def node_settings(
    config: Configuration, tree: str, own: tuple[str, ...], folder: Path, whose: str
) -> tuple[dict[str, Any], NodeSettings]:
    """Return the values below a path, and the node settings among them.

    :param own: further allowed keys.
    :param folder: the base of relative paths.
    :param whose: the configured component, for errors.
    """
    values = values_below(config, tree)
    known = (*own, *OF_NODE)
    with placed(config, tree):
        for key in values:
            if key.split("/")[0] not in known:
                raise ConfigError(f"{whose}: there is no setting '{key}'", hint=did_you_mean(key, known))
        return values, NodeSettings.of(values, folder, whose)


def nodes_stay_here(config: Configuration) -> bool:
    """Return whether only nodes of this machine can reach the configured nodes.

    An invalid section counts as local: its component reports the error.
    """
    return all(_stays_here(config, tree) for tree in _trees(config))


def _trees(config: Configuration) -> Iterator[str]:
    """Yield the sections of nodes that serve requests."""
    for name in config.keys(_ROS2):
        tree = f"{_ROS2}/{name}"
        if name in _OF_SEVERAL:
            yield from (f"{tree}/{key}" for key in config.keys(tree))
        elif name not in _ASKS and has_ours(config, tree):
            yield tree


def _stays_here(config: Configuration, tree: str) -> bool:
    values = {key: value for key, value in values_below(config, tree).items() if key in OF_NODE}
    try:
        return NodeSettings.of(values, Path(), tree).stays_here
    except CxbridgeError:
        return True


@contextmanager
def placed(config: Configuration, tree: str) -> Iterator[None]:
    """Add file and line of a section to errors about its settings."""
    try:
        yield
    except CxbridgeError as error:
        found = config.search(f"{tree}/")
        first_value = next(
            (each for each in found if is_ours(tree, each.path.removeprefix(f"{tree}/"))), None
        )
        if first_value is not None and error.file is None:
            error.file, error.line = first_value.file, first_value.line
        raise
