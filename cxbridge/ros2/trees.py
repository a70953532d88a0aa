"""Trees of the configuration that have settings of nodes, e.g. ``/ros2/node``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from cxbridge.errors import CxbridgeError
from cxbridge.skiller.board.settings import value_of

if TYPE_CHECKING:
    from cxbridge.config import Configuration


def values_below(config: Configuration, tree: str) -> dict[str, Any]:
    """Return the values below a path, by what follows it."""
    return {
        value.path.removeprefix(f"{tree}/"): [value_of(text) for text in value.items]
        if value.is_list
        else value_of(value.text)
        for value in config.search(f"{tree}/")
    }


@contextmanager
def placed(config: Configuration, tree: str) -> Iterator[None]:
    """Let an error about settings name the file and the line where they begin.

    :raises CxbridgeError: the error, with its place.
    """
    try:
        yield
    except CxbridgeError as error:
        place = next(iter(config.search(f"{tree}/")), None)
        if place is not None and error.file is None:
            error.file, error.line = place.file, place.line
        raise
