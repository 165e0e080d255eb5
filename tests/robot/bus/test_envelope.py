"""Envelopes: 56 bytes, whole or refused."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.bus.envelope import ENVELOPE_BYTES, Envelope, Origin, check_source, pack_head, pack_tail, unpack
from robot.bus.errors import MalformedError
from robot.bus.topic import NAME

envelopes = st.builds(
    Envelope,
    origin=st.builds(
        Origin,
        schema=st.binary(min_size=8, max_size=8),
        clock=st.integers(0, 2**32 - 1),
        begun_ns=st.integers(-(2**63), 2**63 - 1),
        source=st.from_regex(NAME, fullmatch=True).filter(str.isascii),
    ),
    sequence=st.integers(0, 2**64 - 1),
    stamp_ns=st.integers(-(2**63), 2**63 - 1),
    has_words=st.booleans(),
)
ORIGIN = Origin(schema=b"schema_8", clock=1, begun_ns=2, source="twin")
ONE = Envelope(origin=ORIGIN, sequence=3, stamp_ns=4)


def pack(envelope):
    return pack_head(envelope.origin) + pack_tail(envelope.sequence, envelope.stamp_ns, has_words=envelope.has_words)


@given(envelopes, st.binary(max_size=20))
def test_an_envelope_comes_back_with_what_follows_it(envelope, beside):
    raw = pack(envelope)
    assert len(raw) == ENVELOPE_BYTES == 56
    assert unpack(raw + beside) == (envelope, beside)


@given(st.binary(max_size=80))
def test_rubbish_is_malformed_and_never_another_error(raw):
    with pytest.raises(MalformedError, match="expected an envelope"):
        unpack(raw)


@given(envelopes, st.integers(0, ENVELOPE_BYTES - 1), st.integers(0, 255))
def test_a_byte_that_is_another_makes_another_envelope_or_none(envelope, place, byte):
    raw = bytearray(pack(envelope))
    if raw[place] == byte:
        return
    raw[place] = byte
    try:
        changed, _ = unpack(bytes(raw))
    except MalformedError:
        return
    assert changed != envelope


@pytest.mark.parametrize("n", [0, 1, ENVELOPE_BYTES - 1])
def test_an_envelope_that_breaks_off_is_malformed(n):
    with pytest.raises(MalformedError, match=f"56 bytes, got {n}"):
        unpack(pack(ONE)[:n])


@pytest.mark.parametrize("source", ["", "Twin", "0twin", "a" * 17, "a b", "ä", "twin\n", "a\0b"])
def test_a_source_s_name_is_plain(source):
    with pytest.raises(MalformedError, match="source's name"):
        check_source(source)


@pytest.mark.parametrize("source", ["a", "a" * 16, "robot_2"])
def test_a_plain_name_is_taken(source):
    assert (
        unpack(
            pack(Envelope(origin=msgspec.structs.replace(ORIGIN, source=check_source(source)), sequence=0, stamp_ns=0))
        )[0].source
        == source
    )
