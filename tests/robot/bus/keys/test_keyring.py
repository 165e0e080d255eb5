"""A folder of keys: what is issued, taken back and refused; private keys stay private."""

import stat
from datetime import UTC, datetime, timedelta

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec

from robot.bus.errors import BusConfigError
from robot.bus.keys import Keyring, read_credentials
from robot.bus.topic import Role

NOW = datetime(2026, 11, 1, 12, 0, tzinfo=UTC)


@pytest.fixture
def keyring(tmp_path):
    made = Keyring(tmp_path / "keys")
    made.init(now=NOW)
    return made


def issue(keyring, role=Role.TELEOP, *, source="", hosts=(), days=30, now=NOW):
    return keyring.issue(role, source=source, hosts=hosts, days=days, now=now)


def certificate_of(keyring, source):
    return x509.load_pem_x509_certificate((keyring.folder / source / "certificate.pem").read_bytes())


def test_what_is_issued_is_signed_by_the_authority_and_named_like_nothing_else(keyring):
    one, other = issue(keyring), issue(keyring, source="pad")
    root = x509.load_pem_x509_certificate((keyring.folder / "authority.pem").read_bytes())
    for entry in (one, other):
        certificate_of(keyring, entry.source).verify_directly_issued_by(root)
    assert one.name.startswith("teleop.teleop.")
    assert len({one.name, other.name}) == 2
    assert [e.name for e in keyring.ledger().entries] == [one.name, other.name]


def test_private_keys_are_their_owners_alone(keyring):
    issue(keyring)
    keys = list(keyring.folder.rglob("key.pem"))
    assert len(keys) == 2
    assert {stat.S_IMODE(path.stat().st_mode) for path in keys} == {0o600}
    assert {stat.S_IMODE(path.parent.stat().st_mode) for path in keys} == {0o700}


def test_only_a_hub_may_listen_and_only_where_it_says(keyring):
    issue(keyring)
    issue(keyring, Role.ROBOT, hosts=("192.168.1.5", "cell.example"))
    joins, listens = certificate_of(keyring, "teleop"), certificate_of(keyring, "robot")
    uses = [c.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value for c in (joins, listens)]
    assert [x509.ExtendedKeyUsageOID.SERVER_AUTH in use for use in uses] == [False, True]
    names = listens.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert [str(name.value) for name in names] == ["192.168.1.5", "cell.example"]
    with pytest.raises(x509.ExtensionNotFound):
        joins.extensions.get_extension_for_class(x509.SubjectAlternativeName)


def test_a_certificate_signs_no_other(keyring):
    issue(keyring)
    constraints = certificate_of(keyring, "teleop").extensions.get_extension_for_class(x509.BasicConstraints)
    assert constraints.critical
    assert not constraints.value.ca
    assert isinstance(certificate_of(keyring, "teleop").public_key(), ec.EllipticCurvePublicKey)


@pytest.mark.parametrize(
    ("after", "state"), [(timedelta(days=30, seconds=-1), "valid"), (timedelta(days=30), "expired")]
)
def test_a_certificate_is_over_to_the_second(keyring, after, state):
    entry = issue(keyring)
    assert entry.state_at(NOW + after) == state
    if state == "expired":
        with pytest.raises(BusConfigError, match="was over at 2026-12-01"):
            read_credentials(keyring.folder, "teleop", now=NOW + after)
    else:
        assert read_credentials(keyring.folder, "teleop", now=NOW + after).expires == entry.expires


def test_none_outlives_its_authority(keyring):
    late = NOW + timedelta(days=3640)
    root = x509.load_pem_x509_certificate((keyring.folder / "authority.pem").read_bytes())
    assert issue(keyring, days=3650, now=late).expires == root.not_valid_after_utc
    with pytest.raises(BusConfigError, match="authority is over since"):
        issue(keyring, source="pad", now=NOW + timedelta(days=3650))


def test_a_source_has_one_certificate_in_force_and_another_after_it_was_revoked_or_is_over(keyring):
    first = issue(keyring)
    with pytest.raises(BusConfigError, match=f"teleop has {first.name}"):
        issue(keyring)
    keyring.revoke(first.name, now=NOW)
    second = issue(keyring)
    issue(keyring, now=second.expires)
    assert [e.state_at(second.expires) for e in keyring.ledger().entries] == ["revoked", "expired", "valid"]


def test_what_was_never_issued_or_is_revoked_already_is_told_with_what_there_is(keyring):
    entry = issue(keyring)
    with pytest.raises(BusConfigError, match=f"never issued; what can be revoked: {entry.name}"):
        keyring.revoke("teleop", now=NOW)
    keyring.revoke(entry.name, now=NOW)
    with pytest.raises(BusConfigError, match="revoked already; what can be revoked: none"):
        keyring.revoke(entry.name, now=NOW)


def test_a_second_authority_in_one_folder_is_refused(keyring):
    before = (keyring.folder / "authority.pem").read_bytes()
    with pytest.raises(BusConfigError, match="has an authority already"):
        keyring.init(now=NOW)
    assert (keyring.folder / "authority.pem").read_bytes() == before


@pytest.mark.parametrize("source", ["../robot", "Teleop", "a b", "x" * 17])
def test_a_source_that_is_no_name_is_refused_and_nothing_is_written(keyring, source):
    before = sorted(keyring.folder.rglob("*"))
    with pytest.raises(BusConfigError, match="expected a source"):
        issue(keyring, source=source)
    assert sorted(keyring.folder.rglob("*")) == before


@pytest.mark.parametrize("host", ["", "a b", "x/y", "[::1]"])
def test_a_host_that_is_none_is_refused(keyring, host):
    with pytest.raises(BusConfigError, match="address or a name"):
        issue(keyring, Role.ROBOT, hosts=(host,))


def test_where_there_is_no_authority_or_no_ledger_that_is_said(tmp_path, keyring):
    with pytest.raises(BusConfigError, match="autotelic keys init"):
        Keyring(tmp_path / "nowhere").ledger()
    (keyring.folder / "authority" / "ledger.json").write_text("{")
    with pytest.raises(BusConfigError, match="expected a ledger"):
        issue(keyring)
    with pytest.raises(BusConfigError, match="expected a ledger"):
        keyring.ledger()


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda own: (own / "key.pem").unlink(), "expected .*key.pem"),
        (lambda own: (own / "key.pem").chmod(0o640), "chmod 600"),
        (lambda own: (own / "certificate.pem").write_text("no"), r"expected a certificate \(PEM\)"),
        (lambda own: (own.parent / "authority.pem").unlink(), "expected .*authority.pem"),
    ],
)
def test_credentials_that_are_not_whole_are_refused_before_anything_opens(keyring, spoil, told):
    issue(keyring)
    spoil(keyring.folder / "teleop")
    with pytest.raises(BusConfigError, match=told) as refusal:
        read_credentials(keyring.folder, "teleop", now=NOW)
    assert "\n" not in str(refusal.value)
