"""The options of a daemon."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from msgspec import Meta

from cxbridge.run.options import LogOptions, Setting, SourceOptions, StrictnessOptions

# The settings by the options that override them, as paths below ``cxbridge``.
_SETTING_BY_OPTION = {
    "endpoints": "zmq/endpoints",
    "insecure": "zmq/insecure",
    "secret_key": "zmq/secret-key",
    "clients": "zmq/clients",
    "core": "core",
    "skiller": "skiller",
    "executive": "executive",
    "speech": "speech",
    "clock": "clock",
    "on_failure": "on-failure",
    "trace": "record/trace",
    "log": "record/log",
    "bblog": "record/bblog",
}


@dataclass(frozen=True, kw_only=True)
class ConfigurationOptions:
    """The sources of the configuration.

    :param config: a scenario or a Fawkes configuration, with or without a tree ``cxbridge:``.
    :param overlay: files that are laid over the configuration in order.
    """

    config: Annotated[
        Path | None,
        Meta(
            description="A scenario or a Fawkes configuration, whose tree "
            "'cxbridge:' has the settings of the "
            "daemon. Without CONFIG: a blackboard and a Skiller with the shipped skills."
        ),
    ] = None
    overlay: Annotated[
        Path | tuple[Path, ...] | None,
        Meta(description="A configuration file that overrides CONFIG and the files before it. Repeatable."),
    ] = None


@dataclass(frozen=True, kw_only=True)
class ServerOptions:
    """The endpoints of a daemon and their permitted clients."""

    endpoints: Annotated[
        tuple[str, ...],
        Meta(description="Serve over ZeroMQ at this endpoint: tcp://HOST:PORT or ipc://FILE. Repeatable."),
    ] = ()
    insecure: Annotated[
        bool | None, Meta(description="Serve ZeroMQ beyond this machine without CURVE keys.")
    ] = None
    secret_key: Annotated[Path | None, Meta(description="CURVE key file of the daemon.")] = None
    clients: Annotated[Path | None, Meta(description="Folder with the clients' public keys.")] = None


@dataclass(frozen=True, kw_only=True)
class PartOptions:
    """The parts of a daemon.

    :param agent: the agent of the daemon, in a scenario with several agents.
    """

    skiller: Annotated[str | None, Meta(description="The Skiller that executes skills.")] = None
    executive: Annotated[
        bool | None,
        Meta(description="Run the executive; by default if CONFIG has specs."),
    ] = None
    agent: Annotated[
        str | None, Meta(description="The agent of the daemon, if CONFIG has several agents.")
    ] = None
    spec: Annotated[str | None, Meta(description="The executive's spec.")] = None
    speech: Annotated[str | None, Meta(description="Speak the texts that skills say.")] = None
    clock: Annotated[str | None, Meta(description="The clock: real, scaled:N or ros2.")] = None


@dataclass(frozen=True, kw_only=True)
class DaemonSourceOptions(SourceOptions):
    """The sources of an agent's files, the policy for failures, and the recording."""

    clips_dirs: Annotated[tuple[Path, ...], Meta(description="A folder of CLIPS files. Repeatable.")] = ()
    on_failure: Annotated[
        str | None,
        Meta(description="When a component fails, stop the other components or continue with them."),
    ] = None
    trace: Annotated[Path | None, Meta(description="Record to this mcap file.")] = None


@dataclass(frozen=True, kw_only=True)
class DaemonOptions(
    ConfigurationOptions,
    ServerOptions,
    PartOptions,
    DaemonSourceOptions,
    LogOptions,
    StrictnessOptions,
):
    """The options of ``cxbridge daemon``; see its help.

    :param settings: further settings by path below ``cxbridge``, which take precedence.
    """

    commands: ClassVar[frozenset[str]] = frozenset({"agent", "daemon"})

    settings: tuple[tuple[str, Setting], ...] = ()

    def all_settings(self) -> Iterator[tuple[str, Setting]]:
        """Yield path and value of the given settings: of options, of plug-ins' options, then of `settings`.

        The paths are below ``cxbridge``.
        """
        for name, path in _SETTING_BY_OPTION.items():
            value = getattr(self, name)
            if isinstance(value, tuple):
                value = list(value) or None  # an empty tuple: the option is not given
            if value is not None:
                # the configuration resolves relative paths against its own folder, not the user's
                yield path, str(value.absolute()) if isinstance(value, Path) else value
        for group in self.plugin_groups:
            yield from group.settings()
        yield from self.settings
