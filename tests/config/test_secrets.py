"""Secrets of a configuration are masked."""

from __future__ import annotations

import pytest

from cxbridge.config import Configuration
from cxbridge.config.secrets import MASKED_TEXT, has_secrets, is_secret, mask, mask_value
from cxbridge.errors import ConfigError


@pytest.mark.parametrize(
    "path",
    [
        "/cxbridge/web/token",
        "/cxbridge/zmq/secret-key",
        "/x/password",
        "x/dbPassword",
        "/x/DB_PASSWORDS/0",
        "/clients/auth/0/clearpwd",
        "/x/encryption-key",
        "/rcll/peer-private-key",
        "/rcll/crypto_key",
        "/rcll/cryptoKey",
        "/x/apikey",
        "/x/API_KEYS/robot",
        "/credentials/tim/name",
        "/wifi/psk",
        "/webview/users/fawkes",
        "webview//users/fawkes",
    ],
)
def test_secret_names(path):
    assert is_secret(path)
    assert mask(path, "hunter2") == MASKED_TEXT
    assert mask(path, "12345") == MASKED_TEXT
    assert mask(path, "") == ""
    assert mask(path, "true") == "true"


@pytest.mark.parametrize(
    "path",
    [
        "/x/key",
        "/x/tls-key",
        "/webview/tls/key-file",
        "/x/monkey",
        "/x/tokenizer",
        "/x/secretary",
        "/users/name",
        "/x/keys",
        "/x/desks",
        "/spec/action-mapping/create_peer_crypto",
        "/cxbridge/zmq/clients",
    ],
)
def test_public_names(path):
    assert not is_secret(path)
    assert mask(path, "hunter2") == "hunter2"


@pytest.mark.parametrize(
    ("text", "masked"),
    [
        ("mongodb://me:pw@host:27017/db", f"mongodb://{MASKED_TEXT}@host:27017/db"),
        ("mongodb://me:p@w/x@host/db", f"mongodb://{MASKED_TEXT}@host/db"),
        ("https://abcdef@host/x", f"https://{MASKED_TEXT}@host/x"),
        ("http://host/?a=1&access_token=abc&b=2", f"http://host/?a=1&access_token={MASKED_TEXT}&b=2"),
        ("http://host/?api-key=abc", f"http://host/?api-key={MASKED_TEXT}"),
        ("tcp://robot:1911?key=me.key_secret&server-key=robot.key",) * 2,
        ("http://host/a@b",) * 2,
        ("me@example.org",) * 2,
        ("-----BEGIN RSA PRIVATE KEY-----\nMII", MASKED_TEXT),
        ("-----BEGIN CERTIFICATE-----\nMII",) * 2,
    ],
)
def test_secret_parts_of_values_are_masked(text, masked):
    assert mask("/x/uri", text) == masked
    assert mask("", text) == masked


def test_secrets_in_lists_and_errors_are_masked():
    config = Configuration.from_text("web: {tokens: [abc, def], uris: ['x://u:abc@h', y]}\npassword: abc\n")
    assert mask_value(config.get("/web/tokens")).items == (MASKED_TEXT, MASKED_TEXT)
    assert mask_value(config.get("/web/uris")).items == (f"x://{MASKED_TEXT}@h", "y")
    for get, path in ((config.get_uint, "/password"), (config.get_uints, "/web/tokens")):
        with pytest.raises(ConfigError) as caught:
            get(path)
        assert "abc" not in str(caught.value) + str(caught.value.hint)
        assert MASKED_TEXT in str(caught.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a: 1\nb: [x]\n", False),
        ("password: true\n", False),
        ("a: [{k: x, b_token: abc}]\n", True),
        ("password: |\n  ab\n  cd\n", True),
        ("uri: 'mongodb://me:hidden@host/'\n", True),
        ("password: [", True),
        ("a: \xff", True),
    ],
)
def test_unreadable_files_count_as_secret(text, expected):
    assert has_secrets(text.encode("latin-1")) is expected
