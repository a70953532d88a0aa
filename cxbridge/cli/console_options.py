"""The options that say how much of the log a command prints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

from cxbridge.cli.console import ConsoleLog


@dataclass(frozen=True, kw_only=True)
class ConsoleOptions:
    """How much of the log goes to stderr."""

    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Log errors only.")] = False
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log everything.")] = False

    def log(self, *, info: bool = False) -> ConsoleLog:
        """Return what prints the log.

        :param info: whether it prints, without an option, more than warnings and errors: a service does.
        """
        return ConsoleLog(quiet=self.quiet, verbose=self.verbose, info=info)
