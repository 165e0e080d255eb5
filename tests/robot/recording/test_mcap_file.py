"""What is written here another reader opens, and what another writes is opened here."""

import io
import math

import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from robot.bus.topics import VERDICT
from robot.messages import Outcome, Verdict
from robot.recording.errors import DamagedError, UnfitError
from robot.recording.recovering import recover
from robot.recording.session_file import SessionFile
from robot.recording.topics import EVENT
from tests.support.small_session import FEW, LATE, small_session


def test_the_mcap_package_reads_all_of_it(tmp_path):
    path = small_session(tmp_path / "s.mcap")
    with path.open("rb") as opened:
        reader = make_reader(opened, validate_crcs=True)
        summary = reader.get_summary()
        messages = list(reader.iter_messages())
        assert [a.name for a in reader.iter_attachments()] == ["config.yaml"]
        assert [m.name for m in reader.iter_metadata()] == ["session"]
    assert len(messages) == summary.statistics.message_count == FEW + LATE
    assert {schema.encoding for schema, _, _ in messages} == {"jsonschema"}
    assert [m.log_time for _, _, m in messages] == sorted(m.log_time for _, _, m in messages)
    assert summary.statistics.message_end_time == max(m.log_time for _, _, m in messages)


def test_the_mcap_package_reads_it_as_a_stream_with_every_checksum(tmp_path):
    with small_session(tmp_path / "s.mcap").open("rb") as opened:
        records = list(StreamReader(opened, validate_crcs=True).records)
    assert type(records[-1]).__name__ == "Footer"


@pytest.mark.parametrize("compression", list(CompressionType))
def test_a_file_of_the_mcap_package_is_opened(tmp_path, compression):
    buffer = io.BytesIO()
    writer = Writer(buffer, compression=compression, chunk_size=200)
    writer.start()
    schema = writer.register_schema("thing", "jsonschema", b"{}")
    channel = writer.register_channel("/thing", "json", schema)
    for n in range(50):
        writer.add_message(channel, n, b'{"n": %d}' % n, n, n)
    writer.finish()
    path = tmp_path / "foreign.mcap"
    path.write_bytes(buffer.getvalue())
    with SessionFile(path) as session:
        assert [raw.payload for raw in session.raw()] == [b'{"n": %d}' % n for n in range(50)]
        assert session.about == {}
    assert recover(path, tmp_path / "again.mcap").was_whole
    path.write_bytes(buffer.getvalue()[:-300])
    assert recover(path, tmp_path / "saved.mcap").n_messages > 0


def test_numbers_that_are_not_finite_come_back(tmp_path):
    odd = Verdict(stamp_ns=1, sequence=1, outcome=Outcome.REFUSED, amount=math.inf)
    path = small_session(tmp_path / "s.mcap", more=[(VERDICT, odd)])
    with SessionFile(path) as session:
        found = [message for _, _, message in session.messages(VERDICT)]
    assert odd in found
    assert len(found) > 1


def test_messages_of_some_topics_alone_need_no_other_chunk(tmp_path):
    path = small_session(tmp_path / "s.mcap")
    raw = bytearray(path.read_bytes())
    with SessionFile(path) as session:
        ticks = [chunk for chunk in session.chunks if any(session.topic_of(n) == VERDICT.name for n in chunk.index_at)]
    raw[ticks[0].at + 60] ^= 0xFF
    path.write_bytes(raw)
    with SessionFile(path) as session:
        assert len(list(session.messages(EVENT))) == LATE
        with pytest.raises(DamagedError, match="session recover"):
            list(session.messages(VERDICT))


def test_nothing_is_overwritten(tmp_path):
    path = small_session(tmp_path / "s.mcap")
    before = path.read_bytes()
    with pytest.raises(UnfitError, match="expected no file there yet"):
        small_session(path)
    assert path.read_bytes() == before


@pytest.mark.parametrize("raw", [b"", b"\x89MCAP0\r\n", b"nothing of that kind at all, but long enough to look at"])
def test_what_is_no_session_is_refused_in_words(tmp_path, raw):
    path = tmp_path / "s.mcap"
    path.write_bytes(raw)
    with pytest.raises(DamagedError, match="expected"):
        SessionFile(path)
    with pytest.raises(DamagedError, match="expected something whole"):
        recover(path, tmp_path / "out.mcap")
    assert not (tmp_path / "out.mcap").exists()
