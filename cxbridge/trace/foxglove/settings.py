"""Where Foxglove is served."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

DEFAULT_PORT: Final = 8765
"""Where Foxglove looks for a server when nobody says otherwise."""


@dataclass(frozen=True, slots=True)
class FoxgloveSettings:
    """Where to serve.

    :param port: 0: any free one.
    """

    host: str = "127.0.0.1"
    port: int = DEFAULT_PORT
