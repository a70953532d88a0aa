"""Serving with TLS and a token, and unusable certificates."""

from __future__ import annotations

import datetime as dt
import http.client
import ipaddress
import ssl

import pytest

from cxbridge.cli.main import invoke
from cxbridge.errors import ConfigError
from cxbridge_web.tls import check_certificate_and_key
from tests.daemon.test_daemon import WAIT_S
from web_tests.support import serving

x509 = pytest.importorskip("cryptography.x509")
from cryptography.hazmat.primitives import hashes, serialization  # noqa: E402 - needs the package
from cryptography.hazmat.primitives.asymmetric import ec  # noqa: E402 - needs the package

TOKEN = "correct horse battery"
NOW = dt.datetime.now(dt.UTC)
DAY = dt.timedelta(days=1)


def write_pair(folder, name="web", *, password=b""):
    """Write a self-signed certificate for the loopback, and its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "localhost")])
    names = [x509.DNSName("localhost"), x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]
    certificate = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(NOW - DAY)
        .not_valid_after(NOW + DAY)
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .sign(key, hashes.SHA256())
    )
    encryption = serialization.BestAvailableEncryption(password) if password else serialization.NoEncryption()
    pem = serialization.Encoding.PEM
    cert_file, key_file = folder / f"{name}.crt", folder / f"{name}.key"
    cert_file.write_bytes(certificate.public_bytes(pem))
    key_file.write_bytes(key.private_bytes(pem, serialization.PrivateFormat.PKCS8, encryption))
    return cert_file, key_file


@pytest.fixture(name="client", scope="module")
def _client(tmp_path_factory):
    cert, key = write_pair(tmp_path_factory.mktemp("tls"))
    tls = (("web/tls-cert", str(cert)), ("web/tls-key", str(key)), ("web/token", TOKEN))
    with serving((("executive", False), *tls)) as (_, client, _lines):
        assert client.url.startswith("https://")
        client.tls = ssl.create_default_context(cafile=cert)
        yield client


def test_client_with_token_is_served_over_tls(client):
    answer = client.get("/api/cxbridge/status", Authorization=f"Bearer {TOKEN}")
    assert (answer.status, answer.json["kind"]) == (200, "Status")
    with client.open("GET", "/api/cxbridge/events", Authorization=f"Bearer {TOKEN}") as stream:
        assert stream.headers["content-type"] == "text/event-stream"


@pytest.mark.parametrize("path", ["/api/cxbridge/status", "/", "/api/cxbridge/events", "/api/openapi.json"])
def test_client_without_valid_token_is_refused(client, path):
    for headers in (
        {},
        {"Authorization": "Bearer wrong horse battery"},
        {"Authorization": f"Digest {TOKEN}"},
    ):
        assert client.get(path, **headers).status == 401


def test_plain_http_is_not_answered(client):
    connection = http.client.HTTPConnection(client.url.removeprefix("https://"), timeout=WAIT_S)
    connection.request("GET", "/api/cxbridge/status", headers={"Authorization": f"Bearer {TOKEN}"})
    with pytest.raises((http.client.HTTPException, OSError)):
        connection.getresponse()
    connection.close()
    test_client_with_token_is_served_over_tls(client)


def refused_pair_error(cert, key):
    with pytest.raises(ConfigError) as caught:
        check_certificate_and_key(cert, key)
    return caught.value.message, caught.value.file


@pytest.mark.parametrize(
    ("cert", "key", "file", "text"),
    [
        ("nothing", "web.key", "nothing", "the file does not exist"),
        ("web.crt", "nothing", "nothing", "the file does not exist"),
        (".", "web.key", ".", "directory"),
        ("junk", "web.key", "junk", "cannot be used with the key"),
        ("web.crt", "junk", "web.crt", "cannot be used with the key"),
        ("other.crt", "web.key", "other.crt", "KEY_VALUES_MISMATCH"),
        ("locked.crt", "locked.key", "locked.key", "is encrypted"),
    ],
)
def test_unusable_pair_is_error_with_file(tmp_path, cert, key, file, text):
    for name, password in (("web", b""), ("other", b""), ("locked", b"x")):
        write_pair(tmp_path, name, password=password)
    (tmp_path / "junk").write_bytes(b"\0\xff")
    check_certificate_and_key(tmp_path / "web.crt", tmp_path / "web.key")
    message, actual_file = refused_pair_error(tmp_path / cert, tmp_path / key)
    assert (text in message, actual_file) == (True, str(tmp_path / file)), message


def test_daemon_with_unusable_certificate_has_status_2(tmp_path, capsys):
    write_pair(tmp_path)
    (tmp_path / "junk.crt").write_text("no certificate")
    config = tmp_path / "cxbridge.yaml"
    config.write_text("cxbridge: {web: {port: 0, tls-cert: junk.crt, tls-key: web.key}}\n")
    assert invoke(["daemon", "start", str(config)]) == 2
    error = capsys.readouterr().err
    assert f"{tmp_path / 'junk.crt'}: this certificate cannot be used" in error.replace("error: ", "")
    assert "Traceback" not in error
