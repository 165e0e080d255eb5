"""Checkpoints keep state bit for bit and survive torn files."""

import hashlib
import io
import json
import os
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from learning.checkpoint import CheckpointStore, decode, encode, write_atomically
from learning.errors import CheckpointError

LEAVES = (
    st.none()
    | st.booleans()
    | st.integers(min_value=-(2**130), max_value=2**130)
    | st.floats()
    | st.text(max_size=5)
    | hnp.arrays(
        st.sampled_from([np.float32, np.float64, np.int8, np.uint64, np.bool_]),
        hnp.array_shapes(min_dims=0, min_side=0),
    )
)
KEYS = st.text(max_size=5).filter(lambda key: not key.startswith("$"))
TREES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=4), max_leaves=12
)


def bits(value):
    """A value as something whose equality is equality of type and bits."""
    if isinstance(value, dict):
        return {key: bits(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [bits(entry) for entry in value]
    if isinstance(value, np.ndarray):
        return (value.dtype.str, value.shape, value.tobytes())
    if isinstance(value, float):
        return ("float", "nan" if np.isnan(value) else value.hex())
    return (type(value).__name__, value)


@settings(max_examples=150, deadline=None)
@given(tree=TREES)
def test_any_allowed_state_comes_back_bit_for_bit(tree):
    state = {"tree": tree}
    raw = encode(state)
    assert bits(decode(raw)) == bits(state)
    assert encode(decode(raw)) == raw


def test_a_generator_restored_from_a_checkpoint_draws_the_same_numbers():
    rng = np.random.default_rng(7)
    rng.random(5)
    state = decode(encode({"rng": rng.bit_generator.state}))
    expected = rng.random(8)
    other = np.random.default_rng(0)
    other.bit_generator.state = state["rng"]
    assert (other.random(8) == expected).all()


def test_arrays_keep_their_memory_order_and_non_contiguous_ones_their_values():
    fortran = np.asfortranarray(np.arange(6.0).reshape(2, 3))
    strided = np.arange(10)[::3]
    state = decode(encode({"fortran": fortran, "strided": strided}))
    assert state["fortran"].flags.f_contiguous
    assert (state["strided"] == [0, 3, 6, 9]).all()


@pytest.mark.parametrize(
    ("value", "place"),
    [
        ((1, 2), "state.a.b"),
        (np.int64(3), "state.a.b"),
        ({1: 2}, "state.a.b"),
        ({"$array": 0}, "state.a.b"),
        ([0, {1, 2}], r"state\.a\.b\[1\]"),
        (np.array([object()]), "state.a.b"),
    ],
)
def test_what_cannot_be_kept_exactly_is_refused_by_name(value, place):
    with pytest.raises(CheckpointError, match=place):
        encode({"a": {"b": value}})


def test_every_torn_or_changed_file_is_noticed():
    raw = encode({"weights": np.arange(20.0), "epoch": 3})
    for cut in range(0, len(raw), 7):
        with pytest.raises(CheckpointError):
            decode(raw[:cut])
    at = raw.index(np.float64(7.0).tobytes())
    with pytest.raises(CheckpointError):
        decode(raw[:at] + b"\x01" + raw[at + 1 :])


def test_what_was_changed_and_packed_again_is_noticed():
    raw = encode({"weights": np.arange(20.0), "epoch": 3})
    changed = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(raw)) as whole, zipfile.ZipFile(changed, "w") as archive:
        for name in whole.namelist():
            entry = whole.read(name)
            archive.writestr(name, entry.replace(b'"epoch":3', b'"epoch":4') if name == "state.json" else entry)
    with pytest.raises(CheckpointError, match="digests"):
        decode(changed.getvalue())


def test_every_flipped_bit_gives_the_same_state_or_is_told_as_a_torn_checkpoint():
    state = {"weights": np.arange(6.0), "epoch": 3}
    raw = encode(state)
    for bit in range(8 * len(raw)):
        flipped = bytearray(raw)
        flipped[bit // 8] ^= 1 << bit % 8
        try:
            decoded = decode(bytes(flipped))
        except CheckpointError:
            continue
        assert bits(decoded) == bits(state), f"bit {bit}"


def packed(tree):
    """A whole zip with right digests around any tree."""
    raw = json.dumps(tree).encode()
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("state.json", raw)
        archive.writestr("sha256.json", json.dumps({"state.json": hashlib.sha256(raw).hexdigest()}))
    return buffer.getvalue()


@pytest.mark.parametrize("tree", [{"a": {"$array": 0}}, {"a": {"$float": []}}, {"a": {"$float": "much"}}, [1]])
def test_a_whole_zip_that_holds_no_state_is_refused(tree):
    with pytest.raises(CheckpointError):
        decode(packed(tree))


def test_a_newest_checkpoint_marked_as_encrypted_falls_back_to_the_one_before(tmp_path):
    store = CheckpointStore(tmp_path)
    store.save(50, encode({"epoch": 50}))
    newest = store.save(100, encode({"epoch": 100}))
    raw = bytearray(newest.read_bytes())
    raw[raw.index(b"PK\x01\x02") + 8] ^= 1
    newest.write_bytes(raw)
    state, passed_over = store.newest()
    assert state == {"epoch": 50}
    assert "encrypted" in passed_over[0]


def test_only_the_last_two_checkpoints_are_kept_and_no_temporary_file_stays(tmp_path):
    store = CheckpointStore(tmp_path / "checkpoints")
    for epoch in (50, 100, 150):
        store.save(epoch, encode({"epoch": epoch}))
    assert sorted(path.name for path in (tmp_path / "checkpoints").iterdir()) == [
        "checkpoint-00000100.zip",
        "checkpoint-00000150.zip",
    ]
    assert store.newest() == ({"epoch": 150}, [])


def test_a_torn_newest_checkpoint_falls_back_to_the_one_before(tmp_path):
    store = CheckpointStore(tmp_path)
    store.save(50, encode({"epoch": 50}))
    newest = store.save(100, encode({"epoch": 100}))
    newest.write_bytes(newest.read_bytes()[:-30])
    state, passed_over = store.newest()
    assert state == {"epoch": 50}
    assert "checkpoint-00000100.zip" in passed_over[0]


def test_without_any_readable_checkpoint_the_reason_is_told(tmp_path):
    with pytest.raises(CheckpointError, match="there is none"):
        CheckpointStore(tmp_path).newest()
    (tmp_path / "checkpoint-00000050.zip").write_bytes(b"PK")
    with pytest.raises(CheckpointError, match=r"checkpoint-00000050\.zip"):
        CheckpointStore(tmp_path).newest()


def test_a_write_that_fails_half_way_leaves_the_old_bytes(tmp_path, monkeypatch):
    path = tmp_path / "file"
    write_atomically(path, b"first")

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_atomically(path, b"a longer second text")
    assert path.read_bytes() == b"first"


def test_an_atomic_write_replaces_the_whole_file(tmp_path):
    path = tmp_path / "file"
    write_atomically(path, b"a longer first text")
    write_atomically(path, b"second")
    assert path.read_bytes() == b"second"
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]
