"""The settings of plug-ins: sections of the configuration of a run or a daemon."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Final, Self

from cxbridge.config import Configuration
from cxbridge.plugins import Table


class PluginSettings:
    """The base class of settings that plug-ins read from the configuration of a run or a daemon."""

    KEYS: ClassVar[tuple[str, ...]] = ()
    """The keys below ``cxbridge`` that a daemon accepts, as in ``web/port``."""

    @classmethod
    def read(cls, config: Configuration) -> Self | None:  # noqa: ARG003 - for subclasses
        """Return the settings; None when the configuration has none, or switches the servers off.

        :raises ConfigError: when a setting makes no sense.
        """
        return cls()

    @property
    def is_local(self) -> bool:
        """Whether the servers with these settings are for clients of this machine only."""
        return True


SETTINGS: Final[Table[type[Any]]] = Table(
    "SETTINGS",
    lambda loaded: isinstance(loaded, type) and issubclass(loaded, PluginSettings),
    "a subclass of cxbridge.run.plugin_settings.PluginSettings",
)
"""The settings of plug-ins. A row is needed when the configuration may have its settings."""


def plugin_settings(config: Configuration) -> Mapping[str, PluginSettings]:
    """Return the settings that a configuration has for plug-ins, by the names of their rows.

    :raises ConfigError: when a setting makes no sense.
    """
    read = {row.name: SETTINGS.load(row).read(config) for row in SETTINGS.rows if row.needed(config)}
    return {name: settings for name, settings in read.items() if settings is not None}


def plugin_keys() -> Iterator[str]:
    """Yield the keys below ``cxbridge`` that plug-ins know."""
    for row in SETTINGS.rows:
        yield from SETTINGS.load(row).KEYS
