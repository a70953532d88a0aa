"""Encrypted payloads."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.errors import ProtobufError
from cxbridge_protobuf.crypto import CIPHER_NUMBERS, Crypter, derive_key

KEY = "16cf20322cb9067a2b072bfe210e6fb903eef057189c24928520ec857c3e0a09"
"""The key that OpenSSL's EVP_BytesToKey derives from `randomkey`: SHA-256, eight rounds, no salt, AES-256."""


@pytest.mark.parametrize("size", [16, 32])
def test_derived_key_equals_that_of_openssl(size):
    assert derive_key("randomkey", size).hex() == KEY[: 2 * size]


@given(st.sampled_from(list(CIPHER_NUMBERS)), st.text(min_size=1, max_size=20), st.binary(max_size=100))
def test_decryption_returns_encrypted_content(cipher, secret, content):
    crypter = Crypter(secret, cipher)
    sealed = crypter.encrypt(content)
    vector = 16 if cipher.endswith("cbc") else 0
    assert len(sealed) == vector + (len(content) // 16 + 1) * 16
    # the receiver decrypts with the cipher that the frame names, not with the cipher that it sends with
    assert Crypter(secret, "aes-128-ecb").decrypt(crypter.cipher_number, sealed) == content


def test_encryption_equals_that_of_openssl():
    # made with `openssl enc -aes-128-ecb -K KEY`, where KEY is the first half of the key above
    assert Crypter("randomkey", "aes-128-ecb").encrypt(b"hello").hex() == "3c1e8d7f28660585a2944592e95bb6df"


def test_cbc_encrypts_equal_messages_differently():
    crypter = Crypter("k", "aes-256-cbc")
    assert crypter.encrypt(b"x") != crypter.encrypt(b"x")


@given(st.integers(0, 9), st.binary(max_size=80))
def test_garbage_is_error_or_shorter_content(cipher, garbage):
    with contextlib.suppress(ProtobufError):
        assert len(Crypter("k", "aes-128-cbc").decrypt(cipher, garbage)) < len(garbage)


def test_wrong_key_is_error():
    sealed = Crypter("one", "aes-128-ecb").encrypt(b"hello")
    with pytest.raises(ProtobufError, match="same on both sides"):
        Crypter("two", "aes-128-ecb").decrypt(1, sealed)


def test_unknown_cipher_is_error_with_known_ciphers():
    with pytest.raises(ProtobufError, match="no cipher 'rot13'") as refused:
        Crypter("k", "rot13")
    assert "aes-256-cbc" in str(refused.value)
