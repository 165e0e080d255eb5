"""X.509 certificates of an authority and of the processes it vouches for (RFC 5280), on the curve P-256."""

from datetime import datetime, timedelta
from ipaddress import ip_address

import msgspec
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from robot.bus.errors import BusConfigError

__all__ = ["Pair", "expiry_of", "make_authority", "make_certificate"]

CLOCKS_APART = timedelta(minutes=5)
"""A certificate holds from so long before it was made: machines' clocks differ."""


class Pair(msgspec.Struct, frozen=True, kw_only=True):
    """A certificate and its private key, PEM."""

    certificate: bytes
    key: bytes


def make_authority(name: str, *, now: datetime, days: int) -> Pair:
    """Return a new authority, which vouches for itself and for nothing but processes."""
    key = ec.generate_private_key(ec.SECP256R1())
    usage = x509.KeyUsage(
        digital_signature=False, key_cert_sign=True, crl_sign=False, content_commitment=False, key_encipherment=False,
        data_encipherment=False, key_agreement=False, encipher_only=False, decipher_only=False,
    )  # fmt: skip
    certificate = (
        _begun(name, now=now, days=days, public=key.public_key())
        .issuer_name(_named(name))
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    return _pair(certificate, key)


def make_certificate(authority: Pair, name: str, *, hosts: tuple[str, ...], now: datetime, days: int) -> Pair:
    """Return a certificate for one process.

    Args:
        authority: Signs it.
        name: Its common name.
        hosts: Addresses and names that it may listen at; without any it can only join.
        now: From when.
        days: For how long; never longer than the authority's own.

    Raises:
        BusConfigError: the authority is over.
    """
    root = x509.load_pem_x509_certificate(authority.certificate)
    signer = serialization.load_pem_private_key(authority.key, password=None)
    assert isinstance(signer, ec.EllipticCurvePrivateKey), "made by make_authority"
    if now >= root.not_valid_after_utc:
        raise BusConfigError(f"keys: the authority is over since {root.not_valid_after_utc:%Y-%m-%d}: init a new one")
    key = ec.generate_private_key(ec.SECP256R1())
    uses = [ExtendedKeyUsageOID.CLIENT_AUTH] + ([ExtendedKeyUsageOID.SERVER_AUTH] if hosts else [])
    begun = (
        _begun(name, now=now, days=days, public=key.public_key(), until=root.not_valid_after_utc)
        .issuer_name(root.subject)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
        .add_extension(x509.AuthorityKeyIdentifier.from_issuer_public_key(signer.public_key()), critical=False)
    )
    if hosts:
        begun = begun.add_extension(x509.SubjectAlternativeName([_host(h) for h in hosts]), critical=False)
    return _pair(begun.sign(signer, hashes.SHA256()), key)


def expiry_of(certificate: bytes) -> datetime:
    """Return when a certificate is over.

    Raises:
        ValueError: it is none.
    """
    return x509.load_pem_x509_certificate(certificate).not_valid_after_utc


def _begun(
    name: str, *, now: datetime, days: int, public: ec.EllipticCurvePublicKey, until: datetime | None = None
) -> x509.CertificateBuilder:
    end = now + timedelta(days=days)
    return (
        x509.CertificateBuilder()
        .subject_name(_named(name))
        .public_key(public)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - CLOCKS_APART)
        .not_valid_after(end if until is None else min(end, until))
    )


def _named(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _host(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _pair(certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> Pair:
    return Pair(
        certificate=certificate.public_bytes(serialization.Encoding.PEM),
        key=key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        ),
    )
