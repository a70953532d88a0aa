"""Colours and icons on a terminal: only where somebody looks, and as NO_COLOR and FORCE_COLOR ask for."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import IO, Final

_CODES: Final[Mapping[str, str]] = {
    "red": "31",
    "green": "32",
    "yellow": "33",
    "cyan": "36",
    "dim": "2",
    "bold": "1",
}


def wants_colour(stream: IO[str], environ: Mapping[str, str] = os.environ) -> bool:
    """Whether text for a stream is to have colours.

    ``FORCE_COLOR`` asks for them anywhere, ``NO_COLOR`` for none; without either, terminals have them.
    ``FORCE_COLOR=0`` is as ``NO_COLOR``. An empty variable is as none: see https://no-color.org.
    """
    if environ.get("NO_COLOR") or environ.get("FORCE_COLOR") == "0":
        return False
    return bool(environ.get("FORCE_COLOR")) or (stream.isatty() and environ.get("TERM") != "dumb")


def painted(text: str, colour: str) -> str:
    """Return a text in a colour, or dim, or bold; as it is when ``colour`` is empty."""
    return f"\x1b[{_CODES[colour]}m{text}\x1b[0m" if colour and text else text


class Brush:
    """Paints text for one stream, or leaves it as it is.

    :param on: whether there are colours, and icons with them.
    """

    def __init__(self, *, on: bool) -> None:
        self.on = on

    def __call__(self, text: str, colour: str) -> str:
        """Return a text in a colour."""
        return painted(text, colour) if self.on else text
