"""What of a configuration is not told."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.config import Configuration
from cxbridge.config.configuration import ConfigTypeError
from cxbridge.config.secrets import MASKED_TEXT, is_secret, mask, mask_value, remove_secrets


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
def test_names_that_are_not_secret(path):
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
def test_parts_of_values(text, masked):
    assert mask("/x/uri", text) == masked
    assert mask("", text) == masked


def test_lists_and_errors():
    config = Configuration.from_text("web: {tokens: [abc, def], uris: ['x://u:abc@h', y]}\npassword: abc\n")
    assert mask_value(config.get("/web/tokens")).items == (MASKED_TEXT, MASKED_TEXT)
    assert mask_value(config.get("/web/uris")).items == (f"x://{MASKED_TEXT}@h", "y")
    for get, path in ((config.get_uint, "/password"), (config.get_uints, "/web/tokens")):
        with pytest.raises(ConfigTypeError) as caught:
            get(path)
        assert "abc" not in str(caught.value) + str(caught.value.hint)
        assert MASKED_TEXT in str(caught.value)


FILE = """# the robot
web: {port: 1, token: "abcdef", other: abcdef}   # here
mongo:
  uri: 'mongodb://me:hidden@host/'
  password: !regex hidden
  url: &u !url http://h/?api-key=hidden
  again: *u
  hosts: [a, b]
webview/users: {tim: hidden}
"""


def test_secrets_are_cut_out_of_a_file():
    cut = remove_secrets(FILE.encode())
    assert cut is not None
    text = cut.decode()
    assert "hidden" not in text
    assert text.splitlines()[:2] == [
        "# the robot",
        f'web: {{port: 1, token: "{MASKED_TEXT}", other: abcdef}}   # here',
    ]
    before, after = Configuration.from_text(FILE), Configuration.from_text(text)
    assert [value.path for value in after.search()] == [value.path for value in before.search()]
    assert [mask_value(value).text for value in after.search()] == [
        mask_value(value).text for value in before.search()
    ]


def test_what_has_no_secrets_stays_as_it_is():
    assert remove_secrets(b"a: 1 \r\n\r\nb:\t[x]\n") == b"a: 1 \r\n\r\nb:\t[x]\n"


@pytest.mark.parametrize(
    "text",
    ['password: "a\\x62c"', "password: |\n  ab\n  cd\n", "password: a\n  b\n", "password: [", "a: \xff"],
)
def test_a_file_from_which_they_cannot_be_cut_is_none(text):
    assert remove_secrets(text.encode("latin-1")) is None


@given(
    st.text(min_size=1),
    st.sampled_from(['"', "'", ""]),
    st.sampled_from(["password: ", "a: {b_token: ", "- k: x\n  pwd: "]),
)
def test_no_secret_is_left(secret, quote, before):
    """Whatever it is: it is cut out, or there is no file."""
    marked = f"S3CR3T{secret}"
    text = f"{before}{quote}{marked}{quote}{'}' if '{' in before else ''}\n"
    cut = remove_secrets(text.encode("utf-8", "replace"))
    if cut is not None and "S3CR3T" in cut.decode():
        config = Configuration.from_text(cut.decode())
        assert all("S3CR3T" not in mask_value(value).text for value in config.search())
        assert "#" in marked or ":" in marked or "," in marked
