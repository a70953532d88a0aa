"""Encryption of the payloads of frames, as in protobuf_comm.

The protection is weak: keys are unsalted hashes, and payloads are not authenticated. The encryption exists
because the referee box of the RoboCup Logistics League requires it. docs/evidence/protocol-protobuf.md
describes the format.
"""

from __future__ import annotations

import hashlib
import os
from typing import TYPE_CHECKING, Any, Final

from cxbridge.errors import ProtobufError

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.ciphers import Cipher

# the numbers of ciphers in frames
CIPHER_NUMBERS: Final = {"aes-128-ecb": 1, "aes-128-cbc": 2, "aes-256-ecb": 3, "aes-256-cbc": 4}

_CIPHER_NAMES: Final = {cipher_number: name for name, cipher_number in CIPHER_NUMBERS.items()}
_BLOCK_BYTES = 16  # bytes of an AES block
_KEY_SIZES = (16, 32)  # bytes of a key of AES-128, and of AES-256
_HASH_ROUNDS = 8  # the count that protobuf_comm passes to EVP_BytesToKey of OpenSSL


def derive_key(secret: str, size: int) -> bytes:
    """Return protobuf_comm's key for a secret.

    :param size: bytes of the key, at most 32.
    """
    # a text of CLIPS has surrogates in place of bytes that are not UTF-8
    digest = secret.encode("utf-8", "surrogateescape")
    for _ in range(_HASH_ROUNDS):
        digest = hashlib.sha256(digest).digest()
    return digest[:size]


class Crypter:
    """Encrypts with a configured cipher, and decrypts with the cipher that a frame names.

    :param cipher: a name in :data:`CIPHER_NUMBERS`.
    :raises ProtobufError: if the cipher is unknown.
    """

    def __init__(self, secret: str, cipher: str) -> None:
        if cipher not in CIPHER_NUMBERS:
            raise ProtobufError(
                f"there is no cipher '{cipher}'", hint=f"there are: {', '.join(CIPHER_NUMBERS)}"
            )
        self._keys = {size: derive_key(secret, size) for size in _KEY_SIZES}
        self.cipher_number: Final = CIPHER_NUMBERS[cipher]

    def encrypt(self, payload: bytes) -> bytes:
        """Return an encrypted payload, with its initialization vector if the cipher has one."""
        vector = os.urandom(_BLOCK_BYTES) if _has_vector(self.cipher_number) else b""
        padding_size = _BLOCK_BYTES - len(payload) % _BLOCK_BYTES
        transform = self._make_cipher(self.cipher_number, vector).encryptor()
        return (
            vector + transform.update(payload + bytes([padding_size]) * padding_size) + transform.finalize()
        )

    def decrypt(self, cipher_number: int, payload: bytes) -> bytes:
        """Return the decrypted payload.

        Only the padding shows that the key differs: about one payload in 256 has a valid padding by chance.

        :param cipher_number: the number of the cipher, from the frame.
        :raises ProtobufError: if the padding is invalid, the frame is cut, or the cipher is unknown.
        """
        if cipher_number not in _CIPHER_NAMES:
            raise ProtobufError(f"there is no cipher with number {cipher_number}")
        vector_size = _BLOCK_BYTES if _has_vector(cipher_number) else 0
        if len(payload) < vector_size + _BLOCK_BYTES or len(payload) % _BLOCK_BYTES:
            raise ProtobufError("an encrypted frame was cut")
        transform = self._make_cipher(cipher_number, payload[:vector_size]).decryptor()
        padded_payload = transform.update(payload[vector_size:]) + transform.finalize()
        # padding of PKCS 7: the value of each padding byte is the number of padding bytes
        padding_size = padded_payload[-1]
        if (
            not 1 <= padding_size <= _BLOCK_BYTES
            or padded_payload[-padding_size:] != bytes([padding_size]) * padding_size
        ):
            raise ProtobufError("cannot decrypt a frame: is the key the same on both sides?")
        return bytes(padded_payload[:-padding_size])

    def _make_cipher(self, cipher_number: int, vector: bytes) -> Cipher[Any]:
        # slow to import, and few agents encrypt messages
        from cryptography.hazmat.primitives import ciphers  # noqa: PLC0415
        from cryptography.hazmat.primitives.ciphers import algorithms, modes  # noqa: PLC0415

        _, key_bits, _ = _CIPHER_NAMES[cipher_number].split("-")
        key = self._keys[int(key_bits) // 8]
        mode = modes.CBC(vector) if vector else modes.ECB()  # noqa: S305 - the format of protobuf_comm
        return ciphers.Cipher(algorithms.AES(key), mode)


def _has_vector(cipher_number: int) -> bool:
    return _CIPHER_NAMES[cipher_number].endswith("cbc")
