"""The settings of plug-ins: sections of the configuration of a run or a daemon."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar, Final, Self

from cxbridge.config import Configuration
from cxbridge.plugins import Table


class PluginSettings:
    """The base class of settings that plug-ins read from the configuration of a run or a daemon."""

    KEYS: ClassVar[tuple[str, ...]] = ()
    """The keys below ``cxbridge`` that a daemon accepts, as in ``web/port``."""

    SECTION: ClassVar[str] = ""
    """The section of the configuration that has the settings, as in ``/cxbridge/web``."""

    in_runs: ClassVar[bool] = False
    """Whether runs have servers with these settings, too, not only daemons."""

    @classmethod
    def read(cls, config: Configuration) -> Self | None:  # noqa: ARG003 - for subclasses
        """Return the settings; None when the configuration has none, or switches the servers off.

        :raises ConfigError: when a setting is invalid.
        """
        return cls()

    @property
    def is_local(self) -> bool:
        """Whether the servers with these settings are for clients of this machine only."""
        return True


SETTINGS: Final[Table[type[PluginSettings]]] = Table(
    "SETTINGS",
    lambda loaded: isinstance(loaded, type) and issubclass(loaded, PluginSettings),
    "a subclass of cxbridge.run.plugin_settings.PluginSettings",
)
"""The settings of plug-ins. ``needed`` of a row gets the configuration."""


def plugin_settings(config: Configuration, *, of_daemon: bool) -> Mapping[str, PluginSettings]:
    """Return the settings that a configuration has for plug-ins, by the names of their rows.

    :param of_daemon: whether a daemon has the servers; False: a run.
    :raises ConfigError: when a setting is invalid.
    """
    kinds = {row.name: SETTINGS.load(row) for row in SETTINGS.rows if row.needed(config)}
    read = {name: kind.read(config) for name, kind in kinds.items() if of_daemon or kind.in_runs}
    return {name: settings for name, settings in read.items() if settings is not None}


def plugin_keys() -> Iterator[str]:
    """Yield the keys below ``cxbridge`` that plug-ins know."""
    for row in SETTINGS.rows:
        yield from SETTINGS.load(row).KEYS
