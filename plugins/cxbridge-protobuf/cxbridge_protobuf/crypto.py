"""Encrypted payloads of frames. Format: docs/evidence/protocol-protobuf.md.

The protection is weak: keys are unsalted hashes, and payloads are not authenticated. It exists because the
league's referee box requires it.
"""

from __future__ import annotations

import hashlib
import os
from typing import TYPE_CHECKING, Any, Final

from cxbridge.errors import ProtobufError
from cxbridge.extras import plugin_command

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.ciphers import Cipher

# Cipher numbers in frames.
CIPHERS: Final = {"aes-128-ecb": 1, "aes-128-cbc": 2, "aes-256-ecb": 3, "aes-256-cbc": 4}

_NAMES: Final = {number: name for name, number in CIPHERS.items()}
_BLOCK = 16  # bytes of an AES block
_ROUNDS = 8  # the number that protobuf_comm passes to EVP_BytesToKey


def derive_key(secret: str, size: int) -> bytes:
    """Return protobuf_comm's key for a secret.

    :param size: bytes of the key, at most 32.
    """
    digest = secret.encode("utf-8", "surrogateescape")
    for _ in range(_ROUNDS):
        digest = hashlib.sha256(digest).digest()
    return digest[:size]


class Crypter:
    """Encrypts with one cipher and decrypts with the cipher that a frame names.

    :param cipher: a name of :data:`CIPHERS`.
    :raises ProtobufError: if the cipher is unknown, or the package cryptography is missing.
    """

    def __init__(self, secret: str, cipher: str) -> None:
        if cipher not in CIPHERS:
            raise ProtobufError(f"there is no cipher '{cipher}'", hint=f"there are: {', '.join(CIPHERS)}")
        _library()  # called for its error: a missing package is reported here, not with the first message
        self._keys = {size: derive_key(secret, size) for size in (16, 32)}
        self.number: Final = CIPHERS[cipher]

    def encrypt(self, content: bytes) -> bytes:
        """Return an encrypted payload, with its initialization vector if the cipher has one."""
        vector = os.urandom(_BLOCK) if _has_vector(self.number) else b""
        padding = _BLOCK - len(content) % _BLOCK
        worker = self._cipher(self.number, vector).encryptor()
        return vector + worker.update(content + bytes([padding]) * padding) + worker.finalize()

    def decrypt(self, cipher: int, content: bytes) -> bytes:
        """Return the decrypted payload.

        :param cipher: the number in the frame.
        :raises ProtobufError: if the key differs, the frame is cut, or the cipher is unknown.
        """
        if cipher not in _NAMES:
            raise ProtobufError(f"there is no cipher with number {cipher}")
        skip = _BLOCK if _has_vector(cipher) else 0
        if len(content) < skip + _BLOCK or len(content) % _BLOCK:
            raise ProtobufError("an encrypted frame was cut")
        worker = self._cipher(cipher, content[:skip]).decryptor()
        plain = worker.update(content[skip:]) + worker.finalize()
        # PKCS 7 padding: each padding byte is the number of padding bytes
        padding = plain[-1]
        if not 1 <= padding <= _BLOCK or plain[-padding:] != bytes([padding]) * padding:
            raise ProtobufError("a frame does not decrypt: is the key the same on both sides?")
        return bytes(plain[:-padding])

    def _cipher(self, number: int, vector: bytes) -> Cipher[Any]:
        ciphers, algorithms, modes = _library()
        key = self._keys[16 if "128" in _NAMES[number] else 32]
        mode = modes.CBC(vector) if vector else modes.ECB()
        cipher: Cipher[Any] = ciphers.Cipher(algorithms.AES(key), mode)
        return cipher


def _has_vector(number: int) -> bool:
    return _NAMES[number].endswith("cbc")


def _library() -> tuple[Any, Any, Any]:
    """Return the modules of the package cryptography."""
    try:
        # imported only for encryption
        from cryptography.hazmat.primitives import ciphers  # noqa: PLC0415
        from cryptography.hazmat.primitives.ciphers import algorithms, modes  # noqa: PLC0415
    except ImportError:
        raise ProtobufError(
            "encrypted peers need the package cryptography", hint=plugin_command("cxbridge-protobuf")
        ) from None
    return ciphers, algorithms, modes
