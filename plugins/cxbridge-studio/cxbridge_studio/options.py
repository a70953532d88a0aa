"""The option ``--break`` of ``cxbridge run``."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

import typer

from cxbridge.run.options import PluginOptions, RunOptions

if TYPE_CHECKING:
    from cxbridge.run.servers import RunServer


@dataclass(frozen=True, kw_only=True)
class BreakOptions(PluginOptions):
    """The options for the breakpoints of a run."""

    commands: ClassVar[frozenset[str]] = frozenset({"run"})

    breaks: Annotated[
        tuple[str, ...],
        typer.Option(
            "--break",
            metavar="SPEC",
            help="Stop at e.g. rule:NAME or goal:CLASS:MODE, and take commands from stdin. Repeatable.",
        ),
    ] = ()

    @property
    def is_interactive(self) -> bool:
        """Whether a user may stop the rules."""
        return bool(self.breaks)

    def check(self, options: RunOptions) -> None:  # noqa: ARG002 - breakpoints go with any options
        """Check the breakpoints.

        :raises ExecutiveError: if a text is not a breakpoint.
        """
        from cxbridge_studio.debugger.breakpoints import parse_breakpoint  # noqa: PLC0415 - start-up time is a feature

        for spec in self.breaks:
            parse_breakpoint(spec)

    def servers(self) -> Sequence[RunServer]:
        """Return the prompt for the breakpoints; none without breakpoints."""
        if not self.breaks:
            return ()
        from cxbridge.cli.input_lines import InputLines  # noqa: PLC0415 - start-up time is a feature
        from cxbridge_studio.cli.debug_prompt import DebugPrompt  # noqa: PLC0415

        return (DebugPrompt(self.breaks, InputLines(), sys.stdout),)
