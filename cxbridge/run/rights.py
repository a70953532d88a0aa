"""The rights that a configuration gives to the clients of a run or a daemon (docs/security.md, "Rights")."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from cxbridge.config import Configuration
from cxbridge.rights import Rights
from cxbridge.run.plugin_settings import PluginSettings, plugin_settings
from cxbridge.skiller.backend import INSTANCES

_CONTROL: Final = "/cxbridge/remote-control"
_PROGRAMS: Final = "/cxbridge/remote-programs"
_FAWKES_URL: Final = "fawkes://"
"""Of a Skiller that evaluates skill strings, whatever the configuration says."""


def read_rights(
    config: Configuration,
    skiller: str,
    settings: Iterable[PluginSettings] | None = None,
    *,
    local: bool = True,
) -> Rights:
    """Return what clients may do.

    :param skiller: who executes skills, as in ``RunOptions.skiller``.
    :param settings: the settings of plug-ins; None: those of a run.
    :param local: whether the servers of cxbridge are for this machine only.
    :raises ConfigError: when the settings do not go together.
    """
    control = config.get_bool(_CONTROL, default=True)
    if settings is None:
        settings = plugin_settings(config, of_daemon=False).values()
    by_default = control and local and all(each.is_local for each in settings)
    programs = config.get_bool(_PROGRAMS, default=by_default)
    if programs and not control:
        message = "clients that may change nothing may run no programs: remote-programs needs remote-control"
        raise config.error(_PROGRAMS, message)
    modes = ["/skiller/mode", *(f"{INSTANCES}/{name}/mode" for name in config.keys(INSTANCES))]
    evaluates = skiller.startswith(_FAWKES_URL) or any(
        config.get_str(mode, default="") == "fawkes" for mode in modes
    )
    return Rights(control, programs, skills_are_programs=evaluates)


def data_may_be_programs(config: Configuration) -> bool:
    """Return whether the configuration says in words that clients may run programs.

    :raises ConfigError: when the value is not a boolean.
    """
    return config.get_bool(_PROGRAMS, default=False)
