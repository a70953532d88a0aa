"""Checks of a server's certificate and key before its start, with errors that name the files."""

from __future__ import annotations

import ssl
from pathlib import Path

from cxbridge.errors import ConfigError


def check_certificate_and_key(cert_file: Path, key_file: Path) -> None:
    """Check a certificate and its key.

    :raises ConfigError: if the certificate or the key is unusable.
    """

    def refuse_password() -> str:
        """Refuse an encrypted key: only for such a key does the module ssl ask for a password.

        :raises ConfigError: always.
        """
        raise ConfigError(
            "this key is encrypted, and a server cannot ask for its password",
            file=key_file,
            hint="decrypt the key: openssl pkey -in KEY -out NEW; only the daemon's user should read it",
        )

    try:
        for file in (cert_file, key_file):
            file.read_bytes()  # the errors of the module ssl do not name the file
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(cert_file, key_file, password=refuse_password)
    except ssl.SSLError as error:
        raise ConfigError(
            f"this certificate cannot be used with the key {key_file}: {error.reason or error}",
            file=cert_file,
            hint="cxbridge/web/tls-cert and tls-key are PEM files; docs/security.md shows how to make them",
        ) from error
    except OSError as error:
        reason = (
            "the file does not exist"
            if isinstance(error, FileNotFoundError)
            else error.strerror or str(error)
        )
        # the loop variable has the file whose reading failed
        raise ConfigError(reason, file=file, hint="cxbridge/web/tls-cert and tls-key") from error
