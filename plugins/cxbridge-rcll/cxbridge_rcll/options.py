"""The options of the commands that play in the RoboCup Logistics League."""

from __future__ import annotations

from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Annotated

import typer

from cxbridge.errors import CxbridgeError


@dataclass(frozen=True, kw_only=True)
class RefboxOptions:
    """The referee box.

    :param refbox_dir: its checkout; None: no game of the league.
    :param proto_dirs: folders with message definitions, before those of the checkouts.
    :param referee_config: files that are laid over its configuration.
    """

    refbox_dir: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Play in the RoboCup Logistics League, with the unchanged rules of this checkout of "
            "rcll-refbox.",
            show_default=False,
        ),
    ] = None
    proto_dirs: Annotated[
        tuple[Path, ...],
        typer.Option(
            "--proto-dir",
            metavar="DIR",
            help="A folder with the league's message definitions, when the checkouts lack their submodules. "
            "Repeatable.",
        ),
    ] = ()
    referee_config: Annotated[
        tuple[Path, ...],
        typer.Option(
            metavar="FILE", help="A file that is laid over the referee box's configuration. Repeatable."
        ),
    ] = ()

    def refuse(self) -> None:
        """Refuse what only a game of the league has.

        :raises CxbridgeError: when some of it is given.
        """
        for each in fields(self):
            if each.default is not MISSING and getattr(self, each.name) != each.default:
                name = each.name.removesuffix("s") if each.name == "proto_dirs" else each.name
                raise CxbridgeError(
                    f"--{name.replace('_', '-')} is for games of the league",
                    hint="name the referee: --refbox-dir",
                )
