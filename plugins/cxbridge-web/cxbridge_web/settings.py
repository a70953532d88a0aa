"""The settings of the web server: the tree ``cxbridge/web`` of a daemon's configuration (docs/rest.md)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Final, Self

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.listening import LOOPBACK, check_server_address
from cxbridge.run.plugin_settings import PluginSettings
from cxbridge_web.tls import check_certificate_and_key

DEFAULT_PORT: Final = 8088  # port of Fawkes' webview

MIN_TOKEN_LENGTH: Final = 16  # characters; a shorter token could be guessed


@dataclass(frozen=True, kw_only=True)
class WebSettings(PluginSettings):
    """The settings of a web server.

    :param port: the port; 0 for any free port.
    :param token: the token of clients; empty to admit every user of this machine.
    :param tls_cert: the PEM file with the certificate; requires ``tls_key``.
    :param tls_key: the PEM file with the private key of the certificate.
    :param allow_origins: the additional origins whose pages may use the API; ``*`` for all origins.
    """

    SECTION: ClassVar[str] = "/cxbridge/web"
    KEYS: ClassVar[tuple[str, ...]] = (
        "web/allow-origins",
        "web/enable",
        "web/host",
        "web/port",
        "web/tls-cert",
        "web/tls-key",
        "web/token",
    )

    host: str = LOOPBACK
    port: int = DEFAULT_PORT
    token: str = ""
    tls_cert: Path | None = None
    tls_key: Path | None = None
    allow_origins: tuple[str, ...] = ()

    @classmethod
    def read(cls, config: Configuration) -> Self | None:
        """Return the settings below ``cxbridge/web``; None without them or with ``enable: false``.

        :raises ConfigError: if a setting is invalid, or the server would be public without token and TLS.
        """
        if not config.get_bool(f"{cls.SECTION}/enable", default=bool(config.keys(cls.SECTION))):
            return None
        settings = cls(
            host=config.get_str(f"{cls.SECTION}/host", default=LOOPBACK),
            port=config.get_port(f"{cls.SECTION}/port", default=DEFAULT_PORT),
            token=config.get_str(f"{cls.SECTION}/token", default=""),
            tls_cert=config.get_file(f"{cls.SECTION}/tls-cert"),
            tls_key=config.get_file(f"{cls.SECTION}/tls-key"),
            allow_origins=tuple(config.get_strings(f"{cls.SECTION}/allow-origins", default=[])),
        )
        settings.check()
        return settings

    def check(self) -> None:
        """Raise :class:`ConfigError` if settings are invalid, conflict or are unsafe."""
        if self.token and len(self.token) < MIN_TOKEN_LENGTH:
            raise ConfigError(
                "cxbridge/web/token is too short",
                hint=f"use {MIN_TOKEN_LENGTH} characters or more, e.g. from openssl rand -hex 16",
            )
        if not self.token.isascii() or not self.token.isprintable():
            raise ConfigError("cxbridge/web/token must consist of printable ASCII characters")
        if (self.tls_cert is None) != (self.tls_key is None):
            raise ConfigError("TLS needs both cxbridge/web/tls-cert and cxbridge/web/tls-key")
        if self.tls_cert is not None and self.tls_key is not None:
            check_certificate_and_key(self.tls_cert, self.tls_key)
        check_server_address(
            "the web server",
            self.host,
            is_local=self.is_local,
            is_restricted=bool(self.token and self.tls_cert),
            hint="set token, tls-cert and tls-key in cxbridge/web, or set host: 127.0.0.1",
        )
