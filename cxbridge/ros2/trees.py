"""Trees of the configuration that have settings of nodes, e.g. ``/ros2/node``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cxbridge.errors import ConfigError, CxbridgeError
from cxbridge.ros2.executor import OF_NODE, NodeSettings
from cxbridge.ros2.fawkes_keys import is_ours
from cxbridge.skiller.board.settings import value_of
from cxbridge.suggestions import did_you_mean

if TYPE_CHECKING:
    from cxbridge.config import Configuration


def values_below(config: Configuration, tree: str) -> dict[str, Any]:
    """Return the values below a path, by what follows it; those of Fawkes' plug-ins are left out."""
    found: dict[str, Any] = {}
    for value in config.search(f"{tree}/"):
        key = value.path.removeprefix(f"{tree}/")
        if is_ours(tree, key):
            found[key] = [value_of(text) for text in value.items] if value.is_list else value_of(value.text)
    return found


def node_settings(
    config: Configuration, tree: str, own: tuple[str, ...], folder: Path, whose: str
) -> tuple[dict[str, Any], NodeSettings]:
    """Return the values below a path, and those among them that are of a node.

    :param own: the keys that it has besides those of a node.
    :param folder: what relative folders are seen from.
    :param whose: what is configured, for errors.
    :raises CxbridgeError: when they make no sense.
    """
    values = values_below(config, tree)
    known = (*own, *OF_NODE)
    with placed(config, tree):
        for key in values:
            if key.split("/")[0] not in known:
                raise ConfigError(f"{whose}: there is no setting '{key}'", hint=did_you_mean(key, known))
        return values, NodeSettings.of(values, folder, whose)


@contextmanager
def placed(config: Configuration, tree: str) -> Iterator[None]:
    """Let an error about settings name the file and the line where they begin.

    :raises CxbridgeError: the error, with its place.
    """
    try:
        yield
    except CxbridgeError as error:
        found = config.search(f"{tree}/")
        place = next((each for each in found if is_ours(tree, each.path.removeprefix(f"{tree}/"))), None)
        if place is not None and error.file is None:
            error.file, error.line = place.file, place.line
        raise
