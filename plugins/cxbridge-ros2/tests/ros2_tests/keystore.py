"""A keystore for DDS security, laid out as `ros2 security` does."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import pkcs7
from cryptography.x509.oid import NameOID

_ENCRYPTED, _SIGNED = "ENCRYPT", "SIGN"


def _element(name: str, *inner: str) -> str:
    return f"<{name}>{''.join(inner)}</{name}>"


def _elements(values: dict[str, str]) -> str:
    return "".join(_element(name, value) for name, value in values.items())


_DOMAINS = _element("domains", _element("id_range", _elements({"min": "0", "max": "230"})))
_OF_TOPICS = {
    "topic_expression": "*",
    **{f"enable_{what}_protection": "true" for what in ("discovery", "liveliness")},
    **{f"enable_{what}_access_control": "true" for what in ("read", "write")},
    **{f"{what}_protection_kind": _ENCRYPTED for what in ("metadata", "data")},
}
_OF_DOMAIN = {
    "allow_unauthenticated_participants": "false",
    "enable_join_access_control": "true",
    **{f"{what}_protection_kind": _ENCRYPTED for what in ("discovery", "liveliness")},
    "rtps_protection_kind": _SIGNED,
    "topic_access_rules": _element("topic_rule", _elements(_OF_TOPICS)),
}
_RULES = _element("domain_access_rules", _element("domain_rule", _DOMAINS, _elements(_OF_DOMAIN)))
_GOVERNANCE = _element("dds", _RULES)
_ALL_TOPICS = _element("topics", _element("topic", "*"))


def _permissions(enclave: str) -> str:
    """Return the document that lets an enclave do everything."""
    years = {"not_before": "2020-01-01T00:00:00", "not_after": "2040-01-01T00:00:00"}
    allowed = _element(
        "allow_rule", _DOMAINS, _elements(dict.fromkeys(("publish", "subscribe"), _ALL_TOPICS))
    )
    grant = {"subject_name": f"CN={enclave}", "validity": _elements(years)}
    inner = _elements(grant) + allowed + _element("default", "DENY")
    return _element("dds", _element("permissions", f'<grant name="all">{inner}</grant>'))


class Authority:
    """Signs certificates and documents."""

    def __init__(self) -> None:
        self._key = ec.generate_private_key(ec.SECP256R1())
        self.certificate = self.certify("authority", self._key, is_authority=True)

    def certify(self, name: str, key: ec.EllipticCurvePrivateKey, *, is_authority: bool) -> Any:
        now = datetime.now(UTC)
        return (
            x509.CertificateBuilder()
            .subject_name(_common_name(name))
            .issuer_name(_common_name("authority"))
            .public_key(key.public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - timedelta(days=1))
            .not_valid_after(now + timedelta(days=1))
            .add_extension(x509.BasicConstraints(ca=is_authority, path_length=None), critical=True)
            .sign(self._key, hashes.SHA256())
        )

    def sign(self, text: str) -> bytes:
        made = pkcs7.PKCS7SignatureBuilder().set_data(text.encode())
        options = [pkcs7.PKCS7Options.Text, pkcs7.PKCS7Options.DetachedSignature]
        signer = made.add_signer(self.certificate, self._key, hashes.SHA256())
        return signer.sign(serialization.Encoding.SMIME, options)


def _common_name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def write_keystore(folder: Path, *enclaves: str) -> None:
    """Write the keys of some enclaves that trust each other: ``/robot``."""
    authority = Authority()
    pem = serialization.Encoding.PEM
    trusted = authority.certificate.public_bytes(pem)
    for enclave in enclaves:
        place = folder / "enclaves" / enclave.strip("/")
        place.mkdir(parents=True)
        key = ec.generate_private_key(ec.SECP256R1())
        certificate = authority.certify(enclave, key, is_authority=False)
        private = key.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
        files = {
            "cert.pem": certificate.public_bytes(pem),
            "key.pem": private,
            "identity_ca.cert.pem": trusted,
            "permissions_ca.cert.pem": trusted,
            "governance.p7s": authority.sign(_GOVERNANCE),
            "permissions.p7s": authority.sign(_permissions(enclave)),
        }
        for name, data in files.items():
            (place / name).write_bytes(data)
