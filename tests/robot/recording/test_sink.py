"""A disk that is slow, or full, is told of and never waited for; what was written until then is kept."""

import os
import threading
from itertools import pairwise

import pytest

from robot.bus.topics import VERDICT
from robot.messages import Outcome, Verdict
from robot.recording.recorder import Recorder
from robot.recording.recovering import recover
from robot.recording.session_file import SessionFile
from robot.recording.sink import Sink
from robot.recording.topics import LANES, RECORDED

STEP_NS = 100_000_000


def write(recorder, n, begin=0):
    for i in range(begin, begin + n):
        verdict = Verdict(stamp_ns=i * STEP_NS, sequence=i, outcome=Outcome.PASSED)
        recorder.write(VERDICT, verdict, log_ns=i * STEP_NS)


def test_a_full_disk_is_told_once_and_what_was_written_is_recovered(tmp_path, monkeypatch):
    told, path, room = [], tmp_path / "s.mcap", 50_000
    real = os.write

    def until_full(fd, raw):
        if os.fstat(fd).st_size + len(raw) > room and os.path.samestat(os.fstat(fd), path.stat()):
            real(fd, bytes(raw[:7]))
            raise OSError(28, "No space left on device")
        return real(fd, raw)

    monkeypatch.setattr(os, "write", until_full)
    recorder = Recorder(Sink(path, may_wait=True), lanes=LANES, tell=told.append)
    recorder.prepare(RECORDED)
    write(recorder, 600)
    recorder.close()
    monkeypatch.undo()
    (line,) = told
    assert "no space left on device" in line
    saved = recover(path, tmp_path / "saved.mcap")
    assert saved.n_messages > 50
    assert not saved.lost  # it was cut back to its last whole record


def test_who_records_never_waits_for_a_slow_disk_and_the_loss_is_counted(tmp_path, monkeypatch):
    told, gate = [], threading.Event()
    recorder = Recorder(Sink(tmp_path / "s.mcap", may_wait=False), lanes=LANES, tell=told.append)
    recorder.prepare(RECORDED)
    write(recorder, 4)
    real = os.write

    def slow(fd, raw):
        gate.wait(20.0)
        return real(fd, raw)

    monkeypatch.setattr(os, "write", slow)
    write(recorder, 600, begin=4)  # would take for ever if it waited
    gate.set()
    recorder.close()
    assert recorder.n_lost > 0
    assert "too slow" in told[0]
    with SessionFile(tmp_path / "s.mcap") as session:
        assert len(list(session.raw())) == 604 - recorder.n_lost


def test_what_is_older_than_a_second_is_on_the_disk(tmp_path, monkeypatch):
    now = [0.0]

    def a_third_later():
        now[0] += 0.3
        return now[0]

    synced = []
    monkeypatch.setattr(os, "fdatasync", lambda fd: synced.append(now[0]))
    recorder = Recorder(Sink(tmp_path / "s.mcap", may_wait=True, now_s=a_third_later), lanes=LANES)
    for i in range(30):
        write(recorder, 2, begin=2 * i)
        recorder.flush()
    recorder.close()
    gaps = [b - a for a, b in pairwise([0.0, *synced])]
    assert len(synced) >= 8
    assert max(gaps) <= 1.0 + 3 * 0.3  # the look at the clock before, the one that finds it late, and the one after


def test_a_folder_that_cannot_be_written_to_is_refused_in_words(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="expected a place to record to"):
        Sink(tmp_path / "file" / "s.mcap", may_wait=True)
