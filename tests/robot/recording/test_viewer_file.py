"""A file for viewers says in Protocol Buffers what the session says, read back by the format's own library."""

import json
from pathlib import Path

import msgspec
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.json_format import MessageToDict
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from typer.testing import CliRunner

from robot.bus.topics import ARM_STATE, PERCEPT
from robot.recording.cli import app
from robot.recording.errors import UnfitError
from robot.recording.picture import Picture
from robot.recording.protobuf import Field, Kind, descriptors, encode
from robot.recording.recorder import Recorder
from robot.recording.session_file import SessionFile
from robot.recording.shown import EVERY_NS, Shown
from robot.recording.sink import Sink
from robot.recording.topics import LANES, SCENE, TF
from robot.recording.viewer_file import write_viewer_file
from robot.recording.viewer_kinds import KINDS
from robot.viewer_messages import CompressedImage, Stamp
from tests.support.stations import arm_state, fake_rig, percept

SHIPPED = Path(__file__).parents[2] / "replay/learnt.mcap"


def factory(kind, described):
    """Return the class that the format's library makes of a description."""
    files = descriptor_pb2.FileDescriptorSet.FromString(described)
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(kind))


class Mixed:
    def __init__(self, n, share, text, flag, raw):
        self.n, self.share, self.text, self.flag, self.raw = n, share, text, flag, raw


MIXED = Kind(
    "test.Mixed",
    (
        Field("n", "n", 1, "int64"),
        Field("share", "share", 2, "double"),
        Field("text", "text", 300, "string"),
        Field("flag", "flag", 4, "bool"),
        Field("raw", "raw", 5, "bytes"),
    ),
)


@settings(max_examples=60, deadline=None)
@given(
    n=st.integers(-(1 << 63), (1 << 63) - 1), share=st.floats(allow_nan=False), text=st.text(), flag=st.booleans(),
    raw=st.binary(),
)  # fmt: skip
def test_whatever_is_written_the_formats_own_library_reads(n, share, text, flag, raw):
    found = factory("test.Mixed", descriptors(MIXED)).FromString(encode(MIXED, Mixed(n, share, text, flag, raw)))
    assert (found.n, found.share, found.text, found.flag, found.raw) == (n, share, text, flag, raw)


def test_a_picture_s_bytes_are_in_it_as_they_are():
    kind = KINDS[CompressedImage]
    image = CompressedImage(timestamp=Stamp(sec=3, nsec=5), frame_id="table", data=bytes(range(256)), format="jpeg")
    found = factory(kind.name, descriptors(kind)).FromString(encode(kind, image))
    assert (found.data, found.format, found.frame_id) == (image.data, "jpeg", "table")
    assert (found.timestamp.seconds, found.timestamp.nanos) == (3, 5)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("viewer")
    session, out = folder / "session.mcap", folder / "viewer.mcap"
    recorder, rig = Recorder(Sink(session, may_wait=True), lanes=LANES), fake_rig()
    recorder.note("session", {"serial": "4711"})
    shown = Shown(recorder, Picture(rig.arm, rig.scenario))
    for n, lit in enumerate([0.0, 0.0, 1.0, 0.0]):
        seen = percept({"red_box": (0.4, 0.1 * n, 0.0)}, tcp_m=(0.4, 0.0, 0.2), stamp_ns=n)
        seen = msgspec.structs.replace(seen, button_states=(lit,) * len(rig.scenario.buttons))
        state = arm_state((0.3 * n, -1.5, 1.5, -1.5, -1.5, 0.1), stamp_ns=n)
        recorder.write(ARM_STATE, state, log_ns=n * EVERY_NS)
        shown.perceived(seen, state, log_ns=n * EVERY_NS)
        recorder.write(PERCEPT, seen, log_ns=n * EVERY_NS)
    recorder.close()
    write_viewer_file(session, out)
    return session, out


def of_topic(path, topic):
    with path.open("rb") as opened:
        return [(s, m) for s, _, m in make_reader(opened).iter_messages(topics=[topic])]


@pytest.mark.parametrize("topic", [TF.name, SCENE.name])
def test_a_viewers_file_shows_what_the_session_shows(files, topic):
    session, out = files
    before, after = of_topic(session, topic), of_topic(out, topic)
    assert len(before) == len(after) > 0
    for (_, told), (schema, packed) in zip(before[:40], after[:40], strict=True):
        found = MessageToDict(
            factory(schema.name, schema.data).FromString(packed.data), preserving_proto_field_name=True
        )
        plain = json.loads(told.data)
        assert (schema.encoding, packed.log_time) == ("protobuf", told.log_time)
        assert numbers(found) == pytest.approx(numbers(plain), abs=1e-12)


def numbers(tree):
    """Return all numbers of a message that are not zero, times aside, in order of their names."""
    if isinstance(tree, dict):
        return [n for key in sorted(tree) if key not in ("timestamp", "lifetime") for n in numbers(tree[key])]
    if isinstance(tree, list):
        return [n for item in tree for n in numbers(item)]
    return [tree] if isinstance(tree, float | int) and not isinstance(tree, bool) and tree else []


def test_all_else_is_in_it_as_it_was(files):
    session, out = files
    for topic in (ARM_STATE.name, PERCEPT.name):
        assert [m.data for _, m in of_topic(session, topic)] == [m.data for _, m in of_topic(out, topic)] != []
    with SessionFile(out) as opened:
        assert opened.about == {"serial": "4711"}


def test_what_a_session_does_not_draw_is_drawn_from_what_was_measured_and_perceived(tmp_path):
    write_viewer_file(SHIPPED, tmp_path / "drawn.mcap")
    assert of_topic(SHIPPED, TF.name) == []
    drawn, percepts = of_topic(tmp_path / "drawn.mcap", TF.name), of_topic(SHIPPED, PERCEPT.name)
    assert 0.5 * len(percepts) < len(drawn) <= len(percepts)
    assert len(of_topic(tmp_path / "drawn.mcap", SCENE.name)) >= 1
    with SessionFile(tmp_path / "drawn.mcap") as opened:
        assert {a.name for a in opened.attachments()} >= {"config.yaml"}


def test_nothing_is_overwritten_and_the_command_says_what_is_drawn(files, tmp_path):
    with pytest.raises(UnfitError, match="overwritten"):
        write_viewer_file(*files)
    done = CliRunner().invoke(app, ["export", str(SHIPPED), "-o", str(tmp_path / "new.mcap"), "--to", "viewer"])
    assert done.exit_code == 0, done.output
    assert "of tf" in done.output
