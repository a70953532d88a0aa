"""Serving with TLS and a token, and certificates that cannot be used."""

from __future__ import annotations

import datetime as dt
import http.client
import ipaddress
import os
import ssl

import pytest

from cxbridge.cli.main import invoke
from cxbridge.errors import ConfigError
from cxbridge_web.tls import check_pair
from tests.daemon.test_daemon import WAIT_S
from tests.unprivileged import unprivileged
from web_tests.support import serving

x509 = pytest.importorskip("cryptography.x509")
from cryptography.hazmat.primitives import hashes, serialization  # noqa: E402
from cryptography.hazmat.primitives.asymmetric import ec  # noqa: E402

TOKEN = "correct horse battery"
NOW = dt.datetime.now(dt.UTC)
DAY = dt.timedelta(days=1)


def write_pair(folder, name="web", *, until=NOW + DAY, password=b""):
    """Write a certificate for this machine, signed by itself, and its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    who = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "localhost")])
    names = [x509.DNSName("localhost"), x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]
    made = (
        x509.CertificateBuilder()
        .subject_name(who)
        .issuer_name(who)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(min(NOW, until) - DAY)
        .not_valid_after(until)
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .sign(key, hashes.SHA256())
    )
    lock = serialization.BestAvailableEncryption(password) if password else serialization.NoEncryption()
    pem = serialization.Encoding.PEM
    cert_file, key_file = folder / f"{name}.crt", folder / f"{name}.key"
    cert_file.write_bytes(made.public_bytes(pem))
    key_file.write_bytes(key.private_bytes(pem, serialization.PrivateFormat.PKCS8, lock))
    return cert_file, key_file


@pytest.fixture(name="client", scope="module")
def _client(tmp_path_factory):
    cert, key = write_pair(tmp_path_factory.mktemp("tls"))
    tls = (("web/tls-cert", str(cert)), ("web/tls-key", str(key)), ("web/token", TOKEN))
    with serving((("executive", False), *tls)) as (_, client, _lines):
        assert client.url.startswith("https://")
        client.tls = ssl.create_default_context(cafile=cert)
        yield client


def test_who_has_the_token_is_served_over_tls(client):
    answer = client.get("/api/cxbridge/status", Authorization=f"Bearer {TOKEN}")
    assert (answer.status, answer.json["kind"]) == (200, "Status")
    with client.open("GET", "/api/cxbridge/events", Authorization=f"Bearer {TOKEN}") as stream:
        assert stream.headers["content-type"] == "text/event-stream"


@pytest.mark.parametrize("path", ["/api/cxbridge/status", "/", "/api/cxbridge/events", "/api/openapi.json"])
def test_who_has_another_token_or_none_is_not(client, path):
    for headers in (
        {},
        {"Authorization": "Bearer wrong horse battery"},
        {"Authorization": f"Digest {TOKEN}"},
    ):
        assert client.get(path, **headers).status == 401


def test_plain_http_is_not_answered_and_does_no_harm(client):
    connection = http.client.HTTPConnection(client.url.removeprefix("https://"), timeout=WAIT_S)
    connection.request("GET", "/api/cxbridge/status", headers={"Authorization": f"Bearer {TOKEN}"})
    with pytest.raises((http.client.HTTPException, OSError)):
        connection.getresponse()
    connection.close()
    test_who_has_the_token_is_served_over_tls(client)


def test_a_client_that_does_not_know_the_certificate_does_not_talk(client):
    connection = http.client.HTTPSConnection(
        client.url.removeprefix("https://"), timeout=WAIT_S, context=ssl.create_default_context()
    )
    with pytest.raises(ssl.SSLCertVerificationError):
        connection.request("GET", "/api/cxbridge/status", headers={"Authorization": f"Bearer {TOKEN}"})
    connection.close()


# -- what cannot be used


def refusal(cert, key):
    with pytest.raises(ConfigError) as caught:
        check_pair(cert, key)
    return caught.value.message, caught.value.file


def test_a_pair_that_is_good(tmp_path):
    check_pair(*write_pair(tmp_path))
    check_pair(*write_pair(tmp_path, until=dt.datetime(2061, 1, 1, tzinfo=dt.UTC)))


def test_what_cannot_be_used_is_told_with_its_file(tmp_path):
    cert, key = write_pair(tmp_path)
    old, old_key = write_pair(tmp_path, "old", until=NOW - DAY)
    other, _ = write_pair(tmp_path, "other")
    locked, locked_key = write_pair(tmp_path, "locked", password=b"x")
    junk, cut = tmp_path / "junk.pem", tmp_path / "cut.crt"
    junk.write_bytes(b"\0\xff")
    lines = cert.read_text().splitlines()
    cut.write_text("\n".join([lines[0], "MIIB", lines[-1]]))
    nothing = tmp_path / "nothing"
    for pair, file, text in (
        ((nothing, key), nothing, "the file does not exist"),
        ((cert, nothing), nothing, "the file does not exist"),
        ((tmp_path, key), tmp_path, "directory"),
        ((junk, key), junk, "this file contains no certificate"),
        ((key, key), key, "this file contains no certificate"),
        ((cut, key), cut, "this is not a certificate"),
        ((cert, junk), junk, "this file contains no private key"),
        ((cert, cert), cert, "this file contains no private key"),
        ((old, old_key), old, f"has expired: it was valid until {NOW - DAY:%Y-%m-%d %H:%M} UTC"),
        ((other, key), key, f"does not belong to the certificate {other}"),
        ((locked, locked_key), locked_key, "is encrypted"),
    ):
        message, where = refusal(*pair)
        assert (text in message, where) == (True, str(file)), message


@pytest.mark.skipif(os.name != "posix", reason="there are no permissions of this kind")
def test_a_key_that_others_own_is_told(tmp_path):
    cert, key = write_pair(tmp_path)
    key.chmod(0)
    with unprivileged():
        assert refusal(cert, key) == ("Permission denied", str(key))


def test_a_daemon_with_an_expired_certificate_ends_with_one_line(tmp_path, capsys):
    cert, key = write_pair(tmp_path, until=NOW - DAY)
    config = tmp_path / "cxbridge.yaml"
    config.write_text(f"cxbridge: {{web: {{port: 0, tls-cert: {cert.name}, tls-key: {key.name}}}}}\n")
    assert invoke(["daemon", "start", str(config)]) == 2
    told = capsys.readouterr().err
    assert f"{cert}: this certificate has expired" in told.replace("error: ", "")
    assert "Traceback" not in told
