"""The settings of the server for Fawkes' tools: the tree ``cxbridge/fawkes`` (docs/daemon.md)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

from cxbridge.config import Configuration
from cxbridge.listening import LOOPBACK
from cxbridge.run.plugin_settings import PluginSettings
from cxbridge_fawkes.network.sockets import DEFAULT_PORT


@dataclass(frozen=True, kw_only=True)
class FawkesSettings(PluginSettings):
    """The settings of the server for Fawkes' tools.

    :param allow: addresses and networks that may connect, in addition to loopback.
    """

    SECTION: ClassVar[str] = "/cxbridge/fawkes"
    KEYS: ClassVar[tuple[str, ...]] = ("fawkes/allow", "fawkes/enable", "fawkes/host", "fawkes/port")

    host: str
    port: int
    allow: tuple[str, ...]

    @classmethod
    def read(cls, config: Configuration) -> Self | None:
        """Return the settings; None with ``enable: false``."""
        if not config.get_bool(f"{cls.SECTION}/enable", default=True):
            return None
        return cls(
            host=config.get_str(f"{cls.SECTION}/host", default=LOOPBACK),
            port=config.get_port(f"{cls.SECTION}/port", default=DEFAULT_PORT),
            allow=tuple(config.get_strings(f"{cls.SECTION}/allow", default=[])),
        )
