"""Options for the amount of log output."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

from cxbridge.cli.console import ConsoleLog


@dataclass(frozen=True, kw_only=True)
class ConsoleOptions:
    """The amount of log output on stderr."""

    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Log errors only.")] = False
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log everything.")] = False

    def log(self, *, info: bool = False) -> ConsoleLog:
        """Return a printer of log lines.

        :param info: print also general messages by default, as for services.
        """
        return ConsoleLog(quiet=self.quiet, verbose=self.verbose, info=info)
