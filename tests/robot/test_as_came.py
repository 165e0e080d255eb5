"""What was asked for is kept as it came, and comes back from either encoding."""

import math
from decimal import Decimal
from fractions import Fraction

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.as_came import AsCame, CameField, NonFinite, as_came, float_of
from robot.messages import (
    ArmCommand,
    Executed,
    Grip,
    GripCommand,
    Heading,
    Hold,
    JointTarget,
    Outcome,
    Twist,
    Verdict,
)

NAN, INF = math.nan, math.inf
JSON, PACK = (msgspec.json.encode, msgspec.json.decode), (msgspec.msgpack.encode, msgspec.msgpack.decode)


def same(a, b):
    return a == b or (a != a and b != b)


def numbers(came, name):
    return [float_of(n) for field in came.fields if field.name == name for n in field.numbers]


@pytest.mark.parametrize(("encode", "decode"), [JSON, PACK], ids=["json", "msgpack"])
@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(), max_size=9))
def test_every_float_comes_back_from_either_encoding(encode, decode, values):
    asked = JointTarget(q_rad=tuple(values))
    verdict = Verdict(stamp_ns=1, sequence=1, outcome=Outcome.REFUSED, refused=as_came(asked))
    back = decode(encode(verdict), type=Verdict)
    assert back == verdict
    came = numbers(back.refused, "q_rad")
    assert len(came) == len(values)
    assert all(map(same, came, values))


@pytest.mark.parametrize(("encode", "decode"), [JSON, PACK], ids=["json", "msgpack"])
def test_a_command_with_numbers_that_are_none_comes_back_whole(encode, decode):
    asked = ArmCommand(
        stamp_ns=2**60 + 1, sequence=3, q_rad=(NAN, INF, -INF, 0.1, -0.0, 2.0),
        grip=GripCommand(opening_m=NAN, force_n=20.0, speed_m_s=0.1), digital_out=5,
    )  # fmt: skip
    came = decode(encode(as_came(asked)), type=AsCame)
    assert came == as_came(asked)
    assert came.kind == "ArmCommand"
    assert [f.name for f in came.fields] == [
        "stamp_ns", "sequence", "q_rad", "grip.opening_m", "grip.force_n", "grip.speed_m_s", "digital_out",
    ]  # fmt: skip
    assert all(map(same, numbers(came, "q_rad"), asked.q_rad))
    assert math.isnan(numbers(came, "grip.opening_m")[0])
    assert came.fields[0].numbers == (2**60 + 1,), "a stamp keeps every nanosecond"


@pytest.mark.parametrize("intent", [Heading(heading_rad=0.1, distance_m=0.01, height_m=0.2, grip=Grip.CLOSE), Hold()])
@pytest.mark.parametrize(("encode", "decode"), [JSON, PACK], ids=["json", "msgpack"])
def test_an_intent_that_was_taken_comes_back_as_itself(encode, decode, intent):
    at = (0.0, 0.0, 0.0)
    done = Executed(duration_s=0.05, moved_m=at, target_m=at, requested=intent)
    assert decode(encode(done), type=Executed).requested == intent


def test_a_bare_null_is_no_number_here():
    asked = Twist(linear_m_s=(NAN, INF, -INF))
    assert as_came(asked).fields[0] == CameField(
        name="linear_m_s", numbers=(NonFinite.NAN, NonFinite.INFINITE, NonFinite.MINUS_INFINITE)
    )
    assert b"null" not in msgspec.json.encode(as_came(asked))


class Unspeakable:
    def __repr__(self):
        raise RuntimeError("no words")


class Huge(tuple):
    __slots__ = ()


@pytest.mark.parametrize(
    ("thing", "words"),
    [
        (None, ""),
        ("up", "'up'"),
        ("\ud800", "'\\ud800'"),
        (True, "True"),
        (10**40, "1" + "0" * 40),
        (Fraction(10**400), "Fraction("),
        (Decimal("NaN"), "Decimal('NaN')"),
        ([1.0, "x"], "[1.0, 'x']"),
        (Huge(range(100)), "(0, 1, 2"),
        (b"\xff", "b'\\xff'"),
        (Unspeakable(), "Unspeakable, which cannot be shown: RuntimeError"),
        ({"type": "hold"}, "{'type': 'hold'}"),
    ],
)
def test_what_is_no_intent_at_all_is_kept_in_words(thing, words):
    came = as_came(thing)
    assert came.kind == type(thing).__name__
    assert len(came.fields) == 1
    assert came.fields[0].numbers == ()
    assert came.fields[0].words.startswith(words)
    assert len(came.fields[0].words) <= 200
    for encode, decode in (JSON, PACK):
        assert decode(encode(came), type=AsCame) == came


def test_a_field_of_a_wrong_kind_is_kept_in_words():
    came = as_came(Heading(heading_rad="left", distance_m=0.1, height_m=0.2, grip=Grip.OPEN))
    assert [(f.name, f.numbers, f.words) for f in came.fields] == [
        ("heading_rad", (), "'left'"), ("distance_m", (0.1,), ""), ("height_m", (0.2,), ""), ("grip", (), "open"),
    ]  # fmt: skip
