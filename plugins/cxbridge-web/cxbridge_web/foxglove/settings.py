"""Where Foxglove is served."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from cxbridge.listening import LOOPBACK, check_place, is_loopback

DEFAULT_PORT: Final = 8765
"""Where Foxglove looks for a server when its user names no port."""

PAGES: Final = ("https://app.foxglove.dev", "file://")
"""The origins of Foxglove in a browser, and of Foxglove as a program."""


@dataclass(frozen=True, slots=True)
class FoxgloveSettings:
    """Where to serve.

    :param port: 0: any free one.
    :param allow_origins: the pages that may connect; ``*``: all.
    :param insecure: listen beyond this machine: the protocol has neither passwords nor encryption.
    """

    host: str = LOOPBACK
    port: int = DEFAULT_PORT
    allow_origins: tuple[str, ...] = PAGES
    insecure: bool = False

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
