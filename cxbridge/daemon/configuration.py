"""The configuration of a daemon: a scenario or a Fawkes configuration, overlays, and the options on top."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

from cxbridge.config import Configuration
from cxbridge.daemon.options import DaemonOptions
from cxbridge.daemon.settings import DaemonSettings, read_core
from cxbridge.errors import ConfigError
from cxbridge.events import EventBus
from cxbridge.run.agent import RunBase
from cxbridge.run.agents import agent_names, choose_agent, make_configured_clock, make_main_loop
from cxbridge.run.options import RunOptions, SourceOptions
from cxbridge.run.source import source_of

DEFAULT_CONFIG = Path("cxbridge.yaml")
"""The file that a daemon without a configuration has in errors and in the options of its run."""


def make_daemon_base(options: DaemonOptions) -> tuple[RunBase, DaemonSettings]:
    """Read the configuration; return it with its clock, bus and main loop, and the daemon's settings.

    :raises CxbridgeError: if a file is missing or invalid, or a setting is invalid.
    """
    config, file = read_configuration(options)
    settings = DaemonSettings.from_config(config)
    clock = make_configured_clock(settings.clock, config, file.parent)
    bus = EventBus(clock)
    loop = make_main_loop(source_of(_make_source_options(options)).loop_period_us(config), bus)
    return RunBase("", config, file, clock, bus, loop), settings


def read_configuration(options: DaemonOptions) -> tuple[Configuration, Path]:
    """Return the configuration with its overlays, and its file.

    :raises ConfigError: if the scenario has several agents, and the options choose none.
    :raises CxbridgeError: if a file is missing or invalid.
    """
    config, file = Configuration(), DEFAULT_CONFIG
    source = source_of(_make_source_options(options))
    if source.is_named:
        source.check()
        config, file = source.load_configuration()
    else:
        config.overlay_files(options.overlay)
    if options.agent is not None:
        config = choose_agent(config, options.agent)
    elif names := agent_names(config):
        raise ConfigError(
            "this scenario has several agents",
            file=file,
            hint=f"a daemon runs one agent: choose it with --agent; the agents are: {', '.join(names)}",
        )
    for path, value in options.all_settings():
        config.set(f"/cxbridge/{path}", value)
    return config, file


def _make_source_options(options: DaemonOptions) -> RunOptions:
    """Return the options of a run that has the same sources of files."""
    sources = {field.name: getattr(options, field.name) for field in fields(SourceOptions)}
    # CONFIG of a daemon is the scenario of a run; both lay the files of the option --config over it
    return RunOptions(scenario=options.config, config=options.overlay, **sources)


def make_run_options(options: DaemonOptions, config: Configuration, settings: DaemonSettings) -> RunOptions:
    """Return the options for the parts that daemons share with runs.

    :raises CxbridgeError: if an option is invalid.
    """
    source_options = _make_source_options(options)
    run_options = replace(
        source_options,
        scenario=options.config if source_of(source_options).is_named else DEFAULT_CONFIG,
        spec=options.spec,
        agent=options.agent,
        core=read_core(config),
        clock="real",  # not used: make_daemon_base has made the daemon's clock
        trace=settings.trace,
        trace_level=settings.trace_level,
        trace_files=settings.trace_files,
        log=settings.log,
        bblog=settings.bblog,
        strict=options.strict,
    )
    run_options.check()
    source_of(run_options).check()
    # after the check: a daemon's clock may be scaled although its Skiller is on another blackboard
    return replace(run_options, skiller=settings.skiller, speech=settings.speech)
