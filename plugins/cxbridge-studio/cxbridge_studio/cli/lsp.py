"""``cxbridge lsp``: the language server for editors."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated, Any

import typer

from cxbridge.cli.option_groups import option_groups
from cxbridge.errors import CxbridgeError
from cxbridge.run.options import RunOptions, ScenarioOptions, SourceOptions
from cxbridge.run.source import source_of


@dataclasses.dataclass(frozen=True, kw_only=True)
class _AgentOptions(ScenarioOptions, SourceOptions):
    """The options that select the agent in the editor."""


@option_groups
def lsp(
    options: _AgentOptions,
    recording: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="The recording whose firings are shown above rules; by default, the folder's newest .mcap.",
            show_default=False,
        ),
    ] = None,
) -> int:
    """Serve an editor: the Language Server Protocol on stdin and stdout.

    Without a scenario, the server uses the scenario in the editor's folder. See docs/editors.md.

    Exit status: 0 the editor ended the server; 2 bad usage.

    Example: cxbridge lsp scenarios/test-scenario
    """
    from cxbridge_studio.lsp.handlers import make_server

    json_options = {name: _to_json_value(value) for name, value in vars(options).items()}
    _check_options(options)
    if recording is not None and not recording.is_file():
        raise CxbridgeError("there is no such recording", file=recording)
    make_server({**json_options, "recording": _to_json_value(recording)}).start_io()
    return 0


def _check_options(options: _AgentOptions) -> None:
    """Check the options, so that the command ends at once if an option is invalid.

    The configuration is not checked here: the server reports its mistakes to the editor.

    :raises CxbridgeError: if an option is invalid.
    """
    from cxbridge_studio.lsp.session import find_scenario

    run_options = RunOptions(**vars(options))
    if not source_of(run_options).is_named:
        # an empty path keeps the check from asking for a scenario
        run_options = dataclasses.replace(run_options, scenario=find_scenario(Path.cwd()) or Path())
    run_options.check()


def _to_json_value(value: Any) -> Any:
    """Return the value of an option as a JSON value.

    A tuple becomes a list. Existing paths become absolute, other values become texts, and None, False and
    empty texts do not change.
    """
    if isinstance(value, tuple):
        return [_to_json_value(item) for item in value]
    return str(value.resolve()) if isinstance(value, Path) and value.exists() else value and str(value)
