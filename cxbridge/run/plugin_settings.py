"""Settings of plug-ins in the configuration of a run or a daemon."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar, Final, Self

from cxbridge.config import Configuration
from cxbridge.listening import LOOPBACK, is_loopback
from cxbridge.plugins import Table


class PluginSettings:
    """Base class of a plug-in's settings."""

    KEYS: ClassVar[tuple[str, ...]] = ()
    """The keys that a daemon accepts, relative to ``cxbridge``, e.g. ``web/port``."""

    SECTION: ClassVar[str] = ""
    """The section of the configuration, e.g. ``/cxbridge/web``."""

    host: str = LOOPBACK
    """The address at which the servers listen, if the settings have one."""

    in_runs: ClassVar[bool] = False
    """Whether runs start servers with these settings, in addition to daemons."""

    @classmethod
    def read(cls, config: Configuration) -> Self | None:  # noqa: ARG003 - for subclasses
        """Return the settings; None if the configuration lacks the section or disables the servers.

        :raises ConfigError: if a setting is invalid.
        """
        return cls()

    @property
    def is_local(self) -> bool:
        """Whether the servers accept only clients of this machine."""
        return is_loopback(self.host)


SETTINGS: Final[Table[type[PluginSettings]]] = Table(
    "SETTINGS",
    lambda loaded: isinstance(loaded, type) and issubclass(loaded, PluginSettings),
    "a subclass of cxbridge.run.plugin_settings.PluginSettings",
)
"""The settings of plug-ins. A row's ``needed`` returns whether a configuration needs the settings."""


def read_plugin_settings(config: Configuration, *, of_daemon: bool) -> Mapping[str, PluginSettings]:
    """Return the settings of plug-ins by row name.

    :param of_daemon: whether the settings are for a daemon; a run has only those with ``in_runs``.
    :raises ConfigError: if a setting is invalid.
    """
    classes = {row.name: SETTINGS.load_target(row) for row in SETTINGS.rows if row.needed(config)}
    settings_by_name = {name: cls.read(config) for name, cls in classes.items() if of_daemon or cls.in_runs}
    return {name: settings for name, settings in settings_by_name.items() if settings is not None}


def list_plugin_keys() -> Iterator[str]:
    """Yield the configuration keys of plug-ins, relative to ``cxbridge``."""
    for row in SETTINGS.rows:
        yield from SETTINGS.load_target(row).KEYS
