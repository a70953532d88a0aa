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
    """Check the options as far as that is possible before the editor sends its folder.

    :raises CxbridgeError: if an option is invalid.
    """
    from cxbridge.run.agents import agent_names, choose_agent
    from cxbridge.run.specs import choose_spec
    from cxbridge_studio.lsp.session import find_scenario

    run_options, has_scenario = RunOptions(**vars(options)), True
    if not source_of(run_options).is_named:
        scenario = find_scenario(Path.cwd())
        # an empty path keeps the check from asking for a scenario
        run_options = dataclasses.replace(run_options, scenario=scenario or Path())
        has_scenario = scenario is not None
    run_options.check()
    # without options, nothing selects a part of the configuration: the editor shows its mistakes
    if not has_scenario or not any(vars(options).values()):
        return
    try:
        config, file = source_of(run_options).load_configuration()
    except CxbridgeError as error:
        # a missing file is an error here; the editor shows the mistakes within a file
        if error.line is None:
            raise
        return
    names = [options.agent] if options.agent else agent_names(config)
    if names:
        config = choose_agent(config, names[0])
    if options.spec:
        choose_spec(config, options.spec, file)


def _to_json_value(value: Any) -> Any:
    """Return an option as a JSON value: existing paths become absolute, and empty values stay empty."""
    if isinstance(value, tuple):
        return [_to_json_value(item) for item in value]
    return str(value.resolve()) if isinstance(value, Path) and value.exists() else value and str(value)
