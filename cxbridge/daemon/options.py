"""The options of a daemon on the command line, combined with its configuration."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from cxbridge.config import Configuration
from cxbridge.daemon.settings import DaemonSettings, core_of
from cxbridge.errors import ConfigError
from cxbridge.run.agent_context import agent_names, choose_agent, load_configuration
from cxbridge.run.options import RunOptions

DEFAULT_CONFIG = Path("cxbridge.yaml")
"""Stands for the configuration where none is given; need not exist."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DaemonOptions:
    """The options of ``cxbridge daemon``; see its help.

    :param config: a scenario, or a Fawkes configuration, with or without a tree ``cxbridge:``.
    :param overlay: what is laid over it, each over those before.
    :param agent: the one that it is, of a scenario with several.
    :param settings: more settings, by path below ``cxbridge``; they win over the configuration.
    """

    config: Path | None = None
    overlay: Path | tuple[Path, ...] | None = None
    agent: str | None = None
    spec: str | None = None
    fawkes_dir: Path | None = None
    ros2cx: Path | None = None
    executors: tuple[str, ...] = ()
    clips_dirs: tuple[Path, ...] = ()
    interface_dirs: tuple[Path, ...] = ()
    skill_dirs: tuple[Path, ...] = ()
    settings: tuple[tuple[str, bool | int | str | list[str]], ...] = ()


def read_configuration(options: DaemonOptions) -> tuple[Configuration, Path]:
    """Return the configuration with what was laid over it, and its file.

    :raises CxbridgeError: when a file is missing or wrong.
    """
    config, file = Configuration(), DEFAULT_CONFIG
    if options.config is not None or options.fawkes_dir is not None or options.ros2cx is not None:
        named = RunOptions(
            scenario=options.config,
            fawkes_dir=options.fawkes_dir,
            ros2cx=options.ros2cx,
            config=options.overlay,
        )
        named.check_source()
        config, file = load_configuration(named)
    else:
        config.overlay_files(options.overlay)
    if options.agent is not None:
        config = choose_agent(config, options.agent)
    elif names := agent_names(config):
        hint = f"a daemon is one of them: choose it with --agent; there are: {', '.join(names)}"
        raise ConfigError("this scenario has several agents", file=file, hint=hint)
    for path, value in options.settings:
        config.set(f"/cxbridge/{path}", value)
    return config, file


def make_run_options(options: DaemonOptions, config: Configuration, settings: DaemonSettings) -> RunOptions:
    """Return the options of the parts that runs have, too.

    :raises CxbridgeError: when one makes no sense.
    """
    made = RunOptions(
        scenario=options.config or (None if options.ros2cx else DEFAULT_CONFIG),
        spec=options.spec,
        fawkes_dir=options.fawkes_dir,
        ros2cx=options.ros2cx,
        executors=options.executors,
        core=core_of(config),
        clips_dirs=options.clips_dirs,
        interface_dirs=options.interface_dirs,
        skill_dirs=options.skill_dirs,
        clock="real",
        trace=settings.trace,
        trace_level=settings.trace_level,
        trace_files=settings.trace_files,
        log=settings.log,
        bblog=settings.bblog,
    )
    made.check()
    return replace(made, skiller=settings.skiller, speech=settings.speech)
