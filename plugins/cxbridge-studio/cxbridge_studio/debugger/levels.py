"""The names of log levels in requests and replies of operations."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from cxbridge.errors import ClipsError
from cxbridge.events import Level

LevelName = Annotated[str, Meta(extra_json_schema={"enum": ["debug", "info", "warn", "error"]})]
"""The name of a log level, in lower case as in JSON."""


def find_level(text: str) -> Level:
    """Return the level with a name in lower case, such as ``warn``.

    :raises ClipsError: if the name is unknown.
    """
    levels = {level.name.lower(): level for level in Level}
    if text not in levels:
        raise ClipsError(f"there is no log level '{text}'", hint=f"use one of: {', '.join(levels)}")
    return levels[text]
