"""Rights of the clients of a run or daemon, from its configuration. See "Rights" in docs/security.md."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from cxbridge.config import Configuration
from cxbridge.rights import Rights
from cxbridge.run.plugin_settings import PluginSettings, read_plugin_settings
from cxbridge.skiller.backend import INSTANCES

_CONTROL_KEY: Final = "/cxbridge/remote-control"
_PROGRAMS_KEY: Final = "/cxbridge/remote-programs"
# Fawkes' own Skiller evaluates skill strings as Lua, independently of this configuration.
_FAWKES_URL: Final = "fawkes://"


def read_rights(
    config: Configuration,
    skiller: str,
    settings: Iterable[PluginSettings] | None = None,
    *,
    is_local: bool = True,
) -> Rights:
    """Return the rights of clients.

    :param skiller: the value of ``RunOptions.skiller``.
    :param settings: the settings of plug-ins; None: the settings of plug-ins for runs.
    :param is_local: whether cxbridge's servers accept only clients of this machine.
    :raises ConfigError: if a setting has the wrong type, or the settings contradict each other.
    """
    may_control = config.get_bool(_CONTROL_KEY, default=True)
    if settings is None:
        settings = read_plugin_settings(config, of_daemon=False).values()
    # programs are for local clients unless the configuration permits them explicitly
    all_are_local = is_local and all(plugin_settings.is_local for plugin_settings in settings)
    may_run_programs = config.get_bool(_PROGRAMS_KEY, default=may_control and all_are_local)
    if may_run_programs and not may_control:
        message = "clients that may run programs must be able to change state: set remote-control, too"
        raise config.error(_PROGRAMS_KEY, message)
    mode_keys = ["/skiller/mode", *(f"{INSTANCES}/{name}/mode" for name in config.keys(INSTANCES))]
    evaluates_lua = skiller.startswith(_FAWKES_URL) or any(
        config.get_str(mode_key, default="") == "fawkes" for mode_key in mode_keys
    )
    return Rights(may_control, may_run_programs, skills_are_programs=evaluates_lua)


def permits_remote_programs(config: Configuration) -> bool:
    """Return whether the configuration explicitly lets clients run programs.

    :raises ConfigError: if the value is not a boolean.
    """
    return config.get_bool(_PROGRAMS_KEY, default=False)
