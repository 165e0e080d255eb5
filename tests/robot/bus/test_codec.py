"""Whatever a message of the table holds comes back as it was; what is no message is told so and nothing else."""

import math

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.as_came import AsCame, CameField, NonFinite
from robot.bus.codec import Codec, schema_hash
from robot.bus.errors import MalformedError
from robot.bus.topics import QUERIES, TOPICS, TRUTH
from robot.messages import ObjectPose, Outcome, SceneState, Verdict
from tests.support.any_struct import any_of, is_same

KINDS = sorted(
    {row.kind for row in TOPICS} | {kind for row in QUERIES for kind in (row.request, row.reply)},
    key=lambda kind: kind.__name__,
)


class Picture(msgspec.Struct, frozen=True, kw_only=True):
    exposure_s: float
    note: str | None = None
    pixels: bytes


def there_and_back(message):
    codec = Codec(type(message))
    encoded = codec.encode(message)
    return encoded, codec.decode(encoded.payload, encoded.beside, has_words=encoded.has_words)


@pytest.mark.parametrize("kind", [*KINDS, Picture], ids=lambda kind: kind.__name__)
@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_every_message_of_the_table_comes_back_as_it_was_whatever_its_numbers(kind, data):
    message = data.draw(any_of(kind))
    encoded, back = there_and_back(message)
    assert is_same(back, message)
    text = encoded.beside or encoded.payload
    msgspec.json.decode(text)  # plain JSON, for whoever reads a recording
    assert encoded.has_words is has_words(message)


def has_words(value):
    if isinstance(value, float):
        return not math.isfinite(value)
    if isinstance(value, msgspec.Struct):
        return any(has_words(getattr(value, name)) for name in value.__struct_fields__)
    if isinstance(value, tuple | dict):
        return any(map(has_words, value.values() if isinstance(value, dict) else value))
    return False


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_survives_and_is_read_as_a_number_only_where_the_envelope_says_so(number):
    pose = ObjectPose(name="NaN", position_m=(number, 0.0, 1.0), quat=(1.0, 0.0, 0.0, 0.0))
    scene = SceneState(stamp_ns=1, objects=(pose,))
    encoded, back = there_and_back(scene)
    assert is_same(back, scene)
    with pytest.raises(MalformedError, match=r"position_m"):
        Codec(SceneState).decode(encoded.payload, b"", has_words=False)


@pytest.mark.parametrize("words", [NonFinite.NAN, NonFinite.INFINITE, "NaN", "~NaN", "~", "1"])
def test_a_text_where_a_number_might_be_stays_a_text_beside_a_number_that_is_not_finite(words):
    numbers = (words, math.inf) if isinstance(words, NonFinite) else (math.inf,)
    came = AsCame(kind="Twist", fields=(CameField(name="linear_m_s", numbers=numbers, words=str(words)),))
    verdict = Verdict(stamp_ns=0, sequence=0, outcome=Outcome.REFUSED, amount=math.nan, detail=str(words), refused=came)
    _, back = there_and_back(verdict)
    assert is_same(back.refused, came)
    assert back.detail == words
    assert math.isnan(back.amount)


def test_a_word_that_is_none_is_malformed():
    encoded, _ = there_and_back(Picture(exposure_s=math.nan, pixels=b""))
    for wrong in (b"~Nan", b"~", b"~inf", b"~NaN "):
        with pytest.raises(MalformedError, match="Picture"):
            Codec(Picture).decode(b"", encoded.beside.replace(b"~NaN", wrong), has_words=True)


def test_a_picture_s_bytes_travel_as_they_are_and_the_rest_beside_them():
    encoded, back = there_and_back(Picture(exposure_s=math.nan, pixels=b"\xff\x00" * 9))
    assert encoded.payload == b"\xff\x00" * 9
    assert encoded.has_words
    assert len(encoded.beside) < 60
    assert back.pixels == encoded.payload


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=80), st.binary(max_size=40), st.booleans())
def test_rubbish_is_malformed_and_never_another_error(payload, beside, has_words):
    for kind in (SceneState, Verdict, Picture):
        with pytest.raises(MalformedError, match=kind.__name__):
            Codec(kind).decode(payload, beside, has_words=has_words)


@pytest.mark.parametrize("depth", [10_000, 200_000])
def test_json_that_is_nested_without_end_is_malformed(depth):
    with pytest.raises(MalformedError):
        Codec(SceneState).decode(b'{"other":' + b"[" * depth, b"", has_words=False)


def a_type(name="Thing", *, fields=(("x_m", float),), doc=None):
    return msgspec.defstruct(name, fields, namespace={"__doc__": doc}, kw_only=True)


def test_a_schema_is_another_with_another_name_type_default_or_field_and_the_same_with_another_docstring():
    first = schema_hash(a_type())
    assert schema_hash(a_type()) == first
    assert schema_hash(a_type(doc="Said otherwise.")) == first
    others = [
        a_type("Other"),
        a_type(fields=(("x_mm", float),)),
        a_type(fields=(("x_m", int),)),
        a_type(fields=(("x_m", float, 0.0),)),
        a_type(fields=(("x_m", float), ("y_m", float))),
        a_type(fields=(("description", str), ("x_m", float))),
        a_type(fields=(("description", int), ("x_m", float))),
    ]
    assert len({first, *map(schema_hash, others)}) == 1 + len(others)


def test_no_two_types_of_the_table_have_one_schema():
    assert len({schema_hash(kind) for kind in KINDS}) == len(KINDS)
    assert len(schema_hash(TRUTH.kind)) == 8
