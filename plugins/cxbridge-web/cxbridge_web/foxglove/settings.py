"""Where Foxglove is served."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final, Self

from cxbridge.config import Configuration
from cxbridge.listening import LOOPBACK, check_place, is_loopback
from cxbridge.run.plugin_settings import PluginSettings
from cxbridge_web import FOXGLOVE_PORT

PAGES: Final = ("https://app.foxglove.dev", "file://")
"""The origins of Foxglove in a browser, and of Foxglove as a program."""


@dataclass(frozen=True)
class FoxgloveSettings(PluginSettings):
    """Where to serve.

    :param port: 0: any free one.
    :param allow_origins: the pages that may connect; ``*``: all.
    :param insecure: listen beyond this machine: the protocol has neither passwords nor encryption.
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
    allow_origins: tuple[str, ...] = PAGES
    insecure: bool = False

    @classmethod
    def read(cls, config: Configuration) -> Self | None:
        """Return the settings below ``cxbridge/foxglove``; None without them, or with ``enable: false``."""
        if not config.get_bool(f"{cls.SECTION}/enable", default=bool(config.keys(cls.SECTION))):
            return None
        settings = cls(
            host=config.get_str(f"{cls.SECTION}/host", default=LOOPBACK),
            port=config.get_uint(f"{cls.SECTION}/port", default=FOXGLOVE_PORT),
            allow_origins=tuple(config.get_strings(f"{cls.SECTION}/allow-origins", default=list(PAGES))),
            insecure=config.get_bool(f"{cls.SECTION}/insecure", default=False),
        )
        settings.check()
        return settings

    @property
    def is_local(self) -> bool:
        """Whether the server is for clients of this machine only."""
        return is_loopback(self.host)

    def check(self) -> None:
        """Refuse a place that everybody reaches.

        :raises ConfigError: when the host is beyond the loopback, without ``insecure``.
        """
        check_place(
            "the Foxglove server",
            self.host,
            private=is_loopback(self.host),
            admitted=self.insecure,
            hint="use host: 127.0.0.1 and a tunnel (ssh -L), or say cxbridge/foxglove/insecure: true",
        )
