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
def test_the_key_is_the_one_openssl_derives(size):
    assert derive_key("randomkey", size).hex() == KEY[: 2 * size]


@given(st.sampled_from(list(CIPHER_NUMBERS)), st.text(min_size=1, max_size=20), st.binary(max_size=100))
def test_what_is_encrypted_comes_back(cipher, secret, content):
    crypter = Crypter(secret, cipher)
    sealed = crypter.encrypt(content)
    vector = 16 if cipher.endswith("cbc") else 0
    assert len(sealed) == vector + (len(content) // 16 + 1) * 16
    # the receiver decrypts with the cipher that the frame names, not with the cipher that it sends with
    assert Crypter(secret, "aes-128-ecb").decrypt(crypter.cipher_number, sealed) == content


def test_a_known_ciphertext():
    # made with `openssl enc -aes-128-ecb -K KEY`, where KEY is the first half of the key above
    assert Crypter("randomkey", "aes-128-ecb").encrypt(b"hello").hex() == "3c1e8d7f28660585a2944592e95bb6df"


def test_the_same_message_looks_different_each_time_with_a_vector():
    crypter = Crypter("k", "aes-256-cbc")
    assert crypter.encrypt(b"x") != crypter.encrypt(b"x")


@given(st.integers(0, 9), st.binary(max_size=80))
def test_garbage_does_not_decrypt_or_decrypts_to_something(cipher, garbage):
    with contextlib.suppress(ProtobufError):
        assert len(Crypter("k", "aes-128-cbc").decrypt(cipher, garbage)) < len(garbage)


def test_another_key_is_told():
    sealed = Crypter("one", "aes-128-ecb").encrypt(b"hello")
    with pytest.raises(ProtobufError, match="same on both sides"):
        Crypter("two", "aes-128-ecb").decrypt(1, sealed)


def test_an_unknown_cipher_names_those_there_are():
    with pytest.raises(ProtobufError, match="no cipher 'rot13'") as refused:
        Crypter("k", "rot13")
    assert "aes-256-cbc" in str(refused.value)
