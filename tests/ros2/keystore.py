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

_DOMAINS = "<domains><id_range><min>0</min><max>230</max></id_range></domains>"
_GOVERNANCE = f"""<?xml version="1.0" encoding="UTF-8"?>
<dds><domain_access_rules><domain_rule>{_DOMAINS}
<allow_unauthenticated_participants>false</allow_unauthenticated_participants>
<enable_join_access_control>true</enable_join_access_control>
<discovery_protection_kind>ENCRYPT</discovery_protection_kind>
<liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
<rtps_protection_kind>SIGN</rtps_protection_kind>
<topic_access_rules><topic_rule><topic_expression>*</topic_expression>
<enable_discovery_protection>true</enable_discovery_protection>
<enable_liveliness_protection>true</enable_liveliness_protection>
<enable_read_access_control>true</enable_read_access_control>
<enable_write_access_control>true</enable_write_access_control>
<metadata_protection_kind>ENCRYPT</metadata_protection_kind>
<data_protection_kind>ENCRYPT</data_protection_kind>
</topic_rule></topic_access_rules></domain_rule></domain_access_rules></dds>
"""
_PERMISSIONS = f"""<?xml version="1.0" encoding="UTF-8"?>
<dds><permissions><grant name="all"><subject_name>CN=ENCLAVE</subject_name>
<validity><not_before>2020-01-01T00:00:00</not_before><not_after>2040-01-01T00:00:00</not_after></validity>
<allow_rule>{_DOMAINS}
<publish><topics><topic>*</topic></topics></publish>
<subscribe><topics><topic>*</topic></topics></subscribe>
</allow_rule><default>DENY</default></grant></permissions></dds>
"""


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
            "permissions.p7s": authority.sign(_PERMISSIONS.replace("ENCLAVE", enclave)),
        }
        for name, data in files.items():
            (place / name).write_bytes(data)
