"""Options of a daemon for the server of Fawkes' protocol."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, ClassVar

import typer
from msgspec import Meta

from cxbridge.run.options import PluginOptions, Setting


@dataclass(frozen=True, kw_only=True)
class FawkesOptions(PluginOptions):
    """Options of the server for Fawkes' tools."""

    commands: ClassVar[frozenset[str]] = frozenset({"daemon"})

    fawkes: Annotated[
        bool | None,
        Meta(description="Serve Fawkes' tools, such as ffbblog and ffconfig; on by default."),
    ] = None
    fawkes_host: Annotated[
        str | None, Meta(description="Serve Fawkes' tools at this address; 127.0.0.1 by default.")
    ] = None
    fawkes_port: Annotated[
        int | None,
        Meta(
            description="Serve Fawkes' tools on this port; 1910 by default, 0: any free port.", ge=0, le=65535
        ),
    ] = None
    fawkes_allow: Annotated[
        tuple[str, ...],
        typer.Option(metavar="ADDRESS", help="Admit Fawkes' tools of this address or network. Repeatable."),
    ] = ()

    def settings(self) -> Iterable[tuple[str, Setting]]:
        values = {
            "enable": self.fawkes,
            "host": self.fawkes_host,
            "port": self.fawkes_port,
            "allow": list(self.fawkes_allow) or None,  # None: the option was not given
        }
        return [(f"fawkes/{name}", value) for name, value in values.items() if value is not None]
