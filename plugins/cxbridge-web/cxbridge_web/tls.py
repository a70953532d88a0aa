"""Checks of a server's certificate and key before the start of the server, with errors that name the file.

The module ssl reports only that a file cannot be loaded, and accepts an expired certificate.
"""

from __future__ import annotations

import re
import ssl
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from cxbridge.errors import ConfigError

_CERTIFICATE: Final = re.compile(r"-----BEGIN CERTIFICATE-----[^-]+-----END CERTIFICATE-----")
_HINT: Final = "cxbridge/web/tls-cert and tls-key are PEM files; docs/security.md shows how to make them"
_VERSION, _SEQUENCE, _UTC_TIME = 0xA0, 0x30, 0x17  # tags of ASN.1
_LONG_LENGTH: Final = 0x80  # the bit that marks a length in further bytes, whose number the other bits give
_CENTURY_LIMIT: Final = 50  # two-digit years below 50 belong to the 21st century (RFC 5280)


def check_pair(cert_file: Path, key_file: Path, now: Callable[[], float] = time.time) -> None:
    """Check a certificate and its key.

    :param now: the clock, in seconds since the epoch.
    :raises ConfigError: if the certificate or the key is unusable.
    """
    text = _read_text(cert_file)
    match = _CERTIFICATE.search(text)
    if match is None:
        raise ConfigError("this file contains no certificate", file=cert_file, hint=_HINT)
    try:
        expiry = _read_expiry(ssl.PEM_cert_to_DER_cert(match[0]))
    except (ValueError, IndexError) as error:
        raise ConfigError("this is not a certificate", file=cert_file, hint=_HINT) from error
    if expiry.timestamp() < now():
        raise ConfigError(
            f"this certificate has expired: it was valid until {expiry:%Y-%m-%d %H:%M} UTC",
            file=cert_file,
            hint="make a new certificate; docs/security.md shows how",
        )
    if "PRIVATE KEY-----" not in _read_text(key_file):
        raise ConfigError("this file contains no private key", file=key_file, hint=_HINT)

    def refuse_password() -> str:
        """Raise the error about an encrypted key: only then does the module ssl ask for a password."""
        raise ConfigError(
            "this key is encrypted, and a server cannot ask for its password",
            file=key_file,
            hint="decrypt the key: openssl pkey -in KEY -out NEW; only the daemon's user should read it",
        )

    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(cert_file, key_file, password=refuse_password)
    except ssl.SSLError as error:
        if error.reason == "KEY_VALUES_MISMATCH":
            raise ConfigError(
                f"this key does not belong to the certificate {cert_file}", file=key_file, hint=_HINT
            ) from error
        raise ConfigError(
            f"this key cannot be used with {cert_file}: {error}", file=key_file, hint=_HINT
        ) from error


def _read_text(file: Path) -> str:
    """Return the text of a file.

    :raises ConfigError: if the file cannot be read.
    """
    try:
        return file.read_bytes().decode("latin-1")
    except OSError as error:
        text = "the file does not exist" if isinstance(error, FileNotFoundError) else f"{error.strerror}"
        raise ConfigError(text, file=file, hint="cxbridge/web/tls-cert and tls-key") from error


def _read_expiry(der: bytes) -> datetime:
    """Return the expiry of a certificate.

    :raises ValueError: if the data is not a certificate.
    :raises IndexError: if the data is cut off.
    """
    _, certificate, _ = _read_element(der)
    _, signed_part, _ = _read_element(certificate)
    tag, _, remaining = _read_element(signed_part)
    # The elements before the validity are: version (optional), serial number, algorithm, issuer. The first
    # element has been read.
    skipped_count = 3 if tag == _VERSION else 2
    for _ in range(skipped_count):
        _, _, remaining = _read_element(remaining)
    tag, validity, _ = _read_element(remaining)
    if tag != _SEQUENCE:
        raise ValueError("no validity")
    _, _, remaining = _read_element(validity)
    tag, text, _ = _read_element(remaining)
    digits = text.decode("ascii")
    if tag == _UTC_TIME:
        digits = ("20" if int(digits[:2]) < _CENTURY_LIMIT else "19") + digits
    return datetime.strptime(digits, "%Y%m%d%H%M%SZ").replace(tzinfo=UTC)


def _read_element(der: bytes) -> tuple[int, bytes, bytes]:
    """Return the tag and the content of the first DER element, and the remaining bytes."""
    tag, length, begin = der[0], der[1], 2
    if length & _LONG_LENGTH:
        begin += length & ~_LONG_LENGTH
        length = int.from_bytes(der[2:begin], "big")
    return tag, der[begin : begin + length], der[begin + length :]
