"""RTDE bytes: frames, recipes, fields by version."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_twin.controller.wire import ControllerVersion, FieldType, input_fields, output_fields
from sim_twin.controller.wire.errors import MalformedError
from sim_twin.controller.wire.rtde_codec import (
    FrameReader,
    Kind,
    Level,
    Recipe,
    frame,
    names_of,
    pack_text,
    unpack_frequency,
)

FLOAT = st.floats(allow_nan=False)
NUMBER_BY_KIND = {
    FieldType.BOOL: st.booleans(),
    FieldType.UINT8: st.integers(0, 2**8 - 1),
    FieldType.UINT32: st.integers(0, 2**32 - 1),
    FieldType.UINT64: st.integers(0, 2**64 - 1),
    FieldType.INT32: st.integers(-(2**31), 2**31 - 1),
    FieldType.DOUBLE: FLOAT,
    FieldType.VECTOR3D: FLOAT,
    FieldType.VECTOR6D: FLOAT,
    FieldType.VECTOR6INT32: st.integers(-(2**31), 2**31 - 1),
    FieldType.VECTOR6UINT32: st.integers(0, 2**32 - 1),
}
SIZES = {
    "BOOL": 1,
    "UINT8": 1,
    "UINT32": 4,
    "UINT64": 8,
    "INT32": 4,
    "DOUBLE": 8,
    "VECTOR3D": 24,
    "VECTOR6D": 48,
    "VECTOR6INT32": 24,
    "VECTOR6UINT32": 24,
}


@st.composite
def recipes_with_values(draw):
    kinds = draw(st.lists(st.sampled_from(list(FieldType)), min_size=1, max_size=12))
    values = [
        draw(NUMBER_BY_KIND[kind])
        if kind.n_items == 1
        else tuple(draw(st.lists(NUMBER_BY_KIND[kind], min_size=kind.n_items, max_size=kind.n_items)))
        for kind in kinds
    ]
    return kinds, values


def flat(values):
    return [number for value in values for number in (value if isinstance(value, tuple) else (value,))]


@given(recipes_with_values(), st.integers(1, 255))
def test_what_is_packed_is_unpacked(recipe_with_values, recipe_id):
    kinds, values = recipe_with_values
    names = [f"f{i}" for i in range(len(kinds))]
    recipe = Recipe(names, kinds, recipe_id=recipe_id)
    ((kind, payload),) = FrameReader().feed(recipe.pack(flat(values)))
    assert kind == Kind.DATA
    assert payload[0] == recipe_id
    assert list(recipe.unpack(payload[1:])) == list(values)
    old = Recipe(names, kinds, recipe_id=None)
    ((_, payload),) = FrameReader().feed(old.pack(flat(values)))
    assert list(old.unpack(payload)) == list(values)


@pytest.mark.parametrize("kind", list(FieldType))
def test_a_type_has_the_size_that_the_guide_gives(kind):
    assert struct.calcsize(f">{kind.code}") == SIZES[kind.value]


@pytest.mark.parametrize("n", [0, 7, 9])
def test_a_body_of_the_wrong_size_is_malformed(n):
    with pytest.raises(MalformedError, match=f"expected 8 bytes for 1 fields, came {n}"):
        Recipe(["x"], [FieldType.DOUBLE], recipe_id=1).unpack(bytes(n))


def test_frames_come_out_whole_however_the_stream_is_cut():
    frames = [(Kind.START, b""), (Kind.INPUTS, b"a,b"), (Kind.DATA, bytes(5000))]
    stream = b"".join(frame(kind, payload) for kind, payload in frames)
    assert FrameReader().feed(stream) == frames
    reader = FrameReader()
    assert [got for byte in stream for got in reader.feed(bytes([byte]))] == frames


@pytest.mark.parametrize("size", [0, 1, 2])
def test_a_size_smaller_than_its_header_is_malformed(size):
    with pytest.raises(MalformedError, match="at least 3 bytes"):
        FrameReader().feed(struct.pack(">HB", size, 86))


@given(st.lists(st.binary(max_size=40), max_size=20))
def test_a_reader_of_anything_gives_frames_or_says_malformed(chunks):
    reader = FrameReader()
    try:
        for chunk in chunks:
            for kind, payload in reader.feed(chunk):
                assert 0 <= kind <= 255
                assert len(payload) <= 65_532
    except MalformedError:
        pass


def test_text_messages_by_protocol():
    assert pack_text("hi", source="me", level=Level.WARNING, protocol=2) == b"\x00\x0aM\x02hi\x02me\x02"
    assert pack_text("hi", source="me", level=Level.ERROR, protocol=1) == b"\x00\x06M\x01hi"
    assert len(pack_text("x" * 999, source="y" * 999, level=Level.INFO, protocol=2)) == 3 + 256 + 256 + 1


@pytest.mark.parametrize(
    ("payload", "names"),
    [
        (b"a,b", ["a", "b"]),
        (b"a,b,", ["a", "b"]),
        (b"", []),
        (b",", [""]),
        (b"a, b\n", ["a", "b"]),
        (b"a,,b", ["a", "", "b"]),
    ],
)
def test_names_of_a_set_up(payload, names):
    assert names_of(payload) == names


def test_an_output_set_up_without_a_frequency_is_malformed():
    with pytest.raises(MalformedError, match="frequency of 8 bytes"):
        unpack_frequency(bytes(7))


@pytest.mark.parametrize(
    ("name", "first", "before"),
    [
        ("safety_status", (5, 4, 0), (5, 3, 9)),
        ("payload", (5, 5, 1), (5, 5, 0)),
        ("payload_inertia", (5, 11, 0), (5, 10, 0)),
        ("payload_inertia", (3, 15, 0), (3, 14, 9)),
        ("ft_raw_wrench", (5, 9, 0), (5, 8, 2)),
        ("ft_raw_wrench", (5, 9, 0), (3, 15, 8)),
        ("actual_current_as_torque", (5, 23, 0), (5, 22, 9)),
        ("actual_current_as_torque", (10, 9, 0), (3, 15, 8)),
        ("output_int_register_24", (5, 3, 0), (5, 2, 0)),
        ("output_double_register_47", (3, 9, 0), (3, 8, 0)),
        ("output_bit_register_64", (5, 3, 0), (5, 2, 0)),
        ("output_int_register_0", (3, 4, 0), (3, 3, 0)),
    ],
)
def test_a_field_comes_with_its_version(name, first, before):
    def fields(version):
        return output_fields(ControllerVersion(**dict(zip(("major", "minor", "bugfix"), version, strict=True))))

    assert name in fields(first)
    assert name not in fields(before)


def test_the_registers_of_an_e_series():
    outputs, inputs = output_fields(ControllerVersion()), input_fields(ControllerVersion())
    for direction, fields in (("output", outputs), ("input", outputs), ("input", inputs)):
        for word, kind, numbers in (
            ("int_register", "INT32", range(48)),
            ("double_register", "DOUBLE", range(48)),
            ("bit_register", "BOOL", range(64, 128)),
        ):
            found = {name: kind for name, kind in fields.items() if name.startswith(f"{direction}_{word}_")}
            assert found == {f"{direction}_{word}_{i}": kind for i in numbers}
        assert fields[f"{direction}_bit_registers0_to_31"] == "UINT32"
        assert fields[f"{direction}_bit_registers32_to_63"] == "UINT32"
    assert not any(name.startswith("output") for name in inputs)


def test_the_fields_that_clients_ask_for_have_the_types_that_they_expect():
    fields = output_fields(ControllerVersion(minor=26))
    expected = {
        "timestamp": "DOUBLE",
        "actual_q": "VECTOR6D",
        "actual_TCP_force": "VECTOR6D",
        "robot_mode": "INT32",
        "joint_mode": "VECTOR6INT32",
        "safety_status_bits": "UINT32",
        "runtime_state": "UINT32",
        "actual_digital_input_bits": "UINT64",
        "actual_tool_accelerometer": "VECTOR3D",
        "payload_cog": "VECTOR3D",
        "tool_output_mode": "UINT8",
        "actual_current_as_torque": "VECTOR6D",
        "target_base_wrench": "VECTOR6D",
        "time_scale_source": "INT32",
    }
    assert {name: fields[name].value for name in expected} == expected
    inputs = input_fields(ControllerVersion())
    assert inputs["external_force_torque"] == "VECTOR6D"
    assert inputs["speed_slider_mask"] == "UINT32"
    assert inputs["standard_digital_output_mask"] == "UINT8"
