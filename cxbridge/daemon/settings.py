"""The settings of a daemon: the tree ``cxbridge:`` of its configuration (docs/daemon.md)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.listening import is_private_endpoint
from cxbridge.plugins import absent_package_hint
from cxbridge.resources import DAEMON_URL
from cxbridge.rights import Rights
from cxbridge.run.components.manager import FailurePolicy
from cxbridge.run.options import CORES, SKILLERS, SPEECH_CHOICES, TRACE_LEVELS
from cxbridge.run.plugin_settings import PluginSettings, list_plugin_keys, read_plugin_settings
from cxbridge.run.rights import read_rights
from cxbridge.suggestions import did_you_mean

TREE = "/cxbridge"
"""The path of the settings in the configuration."""

KEYS = (
    "clock",
    "core",
    "executive",
    "on-failure",
    "record/bblog",
    "record/files",
    "record/level",
    "record/log",
    "record/trace",
    "remote-control",
    "remote-programs",
    "skiller",
    "speech",
    "zmq/clients",
    "zmq/endpoints",
    "zmq/insecure",
    "zmq/secret-key",
)
"""The settings of cxbridge by path below the tree; plug-ins add more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DaemonSettings:
    """The settings of a daemon.

    :param clock: ``real``, ``scaled:N`` or ``ros2``.
    :param executive: whether to run the executive.
    :param skiller: ``lua``, ``simulator``, ``none``, or the URL of a blackboard with a Skiller.
    :param speech: ``on`` or ``off``.
    :param endpoints: the endpoints of the ZeroMQ server.
    :param insecure: whether endpoints that other machines reach may lack CURVE keys.
    :param secret_key: the CURVE key file of the daemon; requires ``clients``.
    :param clients: the folder with the public keys of allowed clients.
    :param sections: the settings of plug-ins by the names of their rows in the table SETTINGS.
    :param on_failure: the reaction to the failure of a component.
    :param rights: the rights of clients.
    :param trace: the mcap file of the recording; None: no recording.
    :param trace_level: ``transitions``, ``rules`` or ``facts``.
    :param trace_files: whether to attach the files of the agent to the recording.
    :param log: the file for a log in the format of Fawkes; None: no log.
    :param bblog: the folder for files in the format of Fawkes' bblogger; None: no such files.
    """

    clock: str
    executive: bool
    skiller: str
    speech: str
    endpoints: tuple[str, ...]
    insecure: bool
    secret_key: Path | None
    clients: Path | None
    sections: Mapping[str, PluginSettings]
    on_failure: FailurePolicy
    rights: Rights
    trace: Path | None
    trace_level: str
    trace_files: bool
    log: Path | None
    bblog: Path | None

    @classmethod
    def from_config(cls, config: Configuration) -> DaemonSettings:
        """Read the settings of a configuration.

        :raises ConfigError: if a setting is unknown or invalid.
        """
        _refuse_unknown_settings(config)

        def read_path(name: str) -> Path | None:
            return config.get_file(f"{TREE}/{name}")

        def read_flag(name: str, default: bool) -> bool:
            return config.get_bool(f"{TREE}/{name}", default=default)

        endpoints = tuple(config.get_strings(f"{TREE}/zmq/endpoints", default=[DAEMON_URL]))
        # clients of other machines may only run programs if the configuration says so
        is_local = all(map(is_private_endpoint, endpoints))
        skiller = _read_choice(config, "skiller", SKILLERS, "lua", accepts_url=True)
        sections = read_plugin_settings(config, of_daemon=True)
        settings = cls(
            clock=config.get_str(f"{TREE}/clock", default="real"),
            executive=read_flag("executive", bool(config.keys("/clips-executive/specs"))),
            skiller=skiller,
            speech=_read_choice(config, "speech", SPEECH_CHOICES, "off"),
            endpoints=endpoints,
            insecure=read_flag("zmq/insecure", False),
            secret_key=read_path("zmq/secret-key"),
            clients=read_path("zmq/clients"),
            sections=sections,
            on_failure=FailurePolicy(_read_choice(config, "on-failure", ("continue", "stop"), "stop")),
            rights=read_rights(config, skiller, sections.values(), is_local=is_local),
            trace=read_path("record/trace"),
            trace_level=_read_choice(config, "record/level", TRACE_LEVELS, "transitions"),
            trace_files=read_flag("record/files", True),
            log=read_path("record/log"),
            bblog=read_path("record/bblog"),
        )
        settings.check()
        return settings

    def check(self) -> None:
        """Raise :class:`ConfigError` for a virtual clock, or if one of the two CURVE settings is missing."""
        if self.clock == "virtual":
            raise ConfigError(
                "a daemon cannot run on a virtual clock", hint="cxbridge/clock: real, scaled:N, or ros2"
            )
        if (self.secret_key is None) != (self.clients is None):
            raise ConfigError(
                "CURVE needs both settings: cxbridge/zmq/secret-key and cxbridge/zmq/clients",
                hint="make keys with cxbridge keys; see docs/security.md",
            )


def _read_choice(
    config: Configuration,
    name: str,
    values: tuple[str, ...],
    default: str,
    *,
    accepts_url: bool = False,
) -> str:
    """Return a setting with a fixed set of values.

    :param accepts_url: whether the URL of a blackboard is also allowed.
    :raises ConfigError: if the setting has another value.
    """
    path = f"{TREE}/{name}"
    value = config.get_str(path, default=default)
    if value in values or (accepts_url and "://" in value):
        return value
    hint = f"one of: {', '.join(values)}" + (", or the URL of a blackboard" if accepts_url else "")
    raise config.error(path, f"{path} cannot be '{value}'", hint)


def read_core(config: Configuration) -> str | None:
    """Return the configured CX core; None: the checkout's core, or cxbridge's own without a checkout.

    :raises ConfigError: if there is no such core.
    """
    return _read_choice(config, "core", CORES, "builtin") if config.exists(f"{TREE}/core") else None


def _refuse_unknown_settings(config: Configuration) -> None:
    """Raise :class:`ConfigError` for unknown settings, because a misspelt setting would have no effect."""
    keys = (*KEYS, *list_plugin_keys())
    for setting in config.search(TREE):
        name = setting.path.removeprefix(f"{TREE}/")
        # agents/ are the agents of a scenario, of which a daemon runs one
        if name not in keys and not name.startswith("agents/"):
            section, _, key = name.partition("/")
            hint = absent_package_hint(section)
            if hint and key == "enable" and setting.text == "false":
                continue  # a server of an absent plug-in that is off
            raise setting.error(
                f"{setting.path} is not a setting of a daemon",
                hint=hint or did_you_mean(name, keys, f"known: {', '.join(sorted(keys))}"),
            )
