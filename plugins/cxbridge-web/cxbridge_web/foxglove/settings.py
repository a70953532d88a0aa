"""The settings of the server for Foxglove."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final, Self

from cxbridge.config import Configuration
from cxbridge.listening import LOOPBACK, check_server_address
from cxbridge.run.plugin_settings import PluginSettings
from cxbridge_web import FOXGLOVE_PORT

# The origins of Foxglove in a browser and of its desktop program.
FOXGLOVE_ORIGINS: Final = ("https://app.foxglove.dev", "file://")


@dataclass(frozen=True)
class FoxgloveSettings(PluginSettings):
    """The settings of the server.

    :param port: the port; 0 for any free port.
    :param allow_origins: the origins of pages that may connect; ``*`` for all origins.
    :param insecure: whether the server may be public, although the protocol has neither passwords nor
        encryption.
    """

    SECTION: ClassVar[str] = "/cxbridge/foxglove"
    KEYS: ClassVar[tuple[str, ...]] = (
        "foxglove/allow-origins",
        "foxglove/enable",
        "foxglove/host",
        "foxglove/insecure",
        "foxglove/port",
    )

    host: str = LOOPBACK
    port: int = FOXGLOVE_PORT
    allow_origins: tuple[str, ...] = FOXGLOVE_ORIGINS
    insecure: bool = False

    @classmethod
    def read(cls, config: Configuration) -> Self | None:
        """Return the settings below ``cxbridge/foxglove``; None without them or with ``enable: false``.

        :raises ConfigError: if a setting is invalid, or the host is public without ``insecure``.
        """
        if not config.get_bool(f"{cls.SECTION}/enable", default=bool(config.keys(cls.SECTION))):
            return None
        settings = cls(
            host=config.get_str(f"{cls.SECTION}/host", default=LOOPBACK),
            port=config.get_port(f"{cls.SECTION}/port", default=FOXGLOVE_PORT),
            allow_origins=tuple(
                config.get_strings(f"{cls.SECTION}/allow-origins", default=list(FOXGLOVE_ORIGINS))
            ),
            insecure=config.get_bool(f"{cls.SECTION}/insecure", default=False),
        )
        settings.check()
        return settings

    def check(self) -> None:
        """Raise :class:`ConfigError` if the host is public without ``insecure``."""
        check_server_address(
            "the Foxglove server",
            self.host,
            is_local=self.is_local,
            is_restricted=self.insecure,  # the option permits all clients
            hint="use host: 127.0.0.1 and a tunnel (ssh -L), or set cxbridge/foxglove/insecure: true",
        )
