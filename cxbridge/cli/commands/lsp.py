"""`cxbridge lsp`: the language server, for editors."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated, Any

import typer

from cxbridge.cli.option_groups import option_groups
from cxbridge.errors import CxbridgeError
from cxbridge.extras import install_command
from cxbridge.run.options import ScenarioOptions, SourceOptions


@dataclasses.dataclass(frozen=True, kw_only=True)
class _AgentOptions(ScenarioOptions, SourceOptions):
    """The agent that the editor works on: options of runs."""


@option_groups
def lsp(
    agent: _AgentOptions,
    recording: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="A run, for the counts above rules; the newest .mcap in the folder by default.",
            show_default=False,
        ),
    ] = None,
) -> int:
    """Serve an editor: the Language Server Protocol on stdin and stdout.

    Without a scenario, the one in the editor's folder counts. Needs the extra 'lsp'. See docs/editors.md.

    Exit status: 0 the editor has ended it; 2 bad usage.

    Example: cxbridge lsp scenarios/test-scenario
    """
    try:
        from cxbridge.lsp.handlers import make_server
    except ModuleNotFoundError as error:
        raise CxbridgeError(f"the package '{error.name}' is not there", hint=install_command("lsp")) from None
    options = {name: _plain(value) for name, value in vars(agent).items()}
    make_server({**options, "recording": _plain(recording)}).start_io()
    return 0


def _plain(value: Any) -> Any:
    """Return the value of an option as JSON can have it."""
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return str(value.resolve()) if isinstance(value, Path) and value.exists() else value and str(value)
