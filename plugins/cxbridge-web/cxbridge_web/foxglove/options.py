"""The option of commands that let Foxglove connect."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

from cxbridge.errors import CxbridgeError
from cxbridge_web.foxglove.settings import DEFAULT_PORT

_MOST_PORT = 65_535


@dataclass(frozen=True, kw_only=True)
class FoxgloveOptions:
    """Whether Foxglove can connect, and where.

    :param foxglove: the port; empty: it was not said; None: Foxglove cannot connect.
    """

    foxglove: Annotated[
        str | None,
        typer.Option(
            metavar="[PORT]",
            help=f"Let Foxglove connect on this machine: at PORT, or {DEFAULT_PORT}; 0: any free one.",
            show_default=False,
        ),
    ] = None

    @property
    def foxglove_port(self) -> int | None:
        """The port for Foxglove; None when none was asked for.

        :raises CxbridgeError: when it is not a port.
        """
        if not self.foxglove:
            return None if self.foxglove is None else DEFAULT_PORT
        if not (self.foxglove.isascii() and self.foxglove.isdecimal() and int(self.foxglove) <= _MOST_PORT):
            raise CxbridgeError(f"--foxglove cannot be at port '{self.foxglove}'", hint="0 to 65535")
        return int(self.foxglove)
