"""Torn, changed and concatenated files: what is whole is saved, every reader opens it; the rest is told in words."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from robot.recording.errors import SessionError
from robot.recording.recovering import recover
from robot.recording.session_file import SessionFile
from tests.support.small_session import FEW, LATE, small_session

ROOT = Path(__file__).parents[3]
SECOND_NS = 1_000_000_000


def n_messages(path):
    """Return how many messages two readers find, which must be the same."""
    with SessionFile(path) as session:
        ours = len(list(session.raw()))
    with path.open("rb") as opened:
        theirs = len(list(make_reader(opened, validate_crcs=True).iter_messages()))
    assert ours == theirs
    return ours


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return small_session(tmp_path_factory.mktemp("small") / "whole.mcap").read_bytes()


def saved(raw, folder, name="saved.mcap"):
    """Return what a recovery said, having checked its file; None where it refused in words."""
    path, out = folder / "broken.mcap", folder / name
    path.write_bytes(raw)
    out.unlink(missing_ok=True)
    try:
        told = recover(path, out)
    except SessionError:
        assert not out.exists()
        return None
    assert n_messages(out) == told.n_messages
    return told


def test_a_whole_file_stays_whole(whole, tmp_path):
    told = saved(whole, tmp_path)
    assert told.was_whole
    assert told.n_messages == FEW + LATE


def test_a_file_cut_at_seven_tenths_keeps_seven_tenths(whole, tmp_path):
    told = saved(whole[: len(whole) * 7 // 10], tmp_path)
    assert not told.was_whole
    assert told.n_messages > 0.4 * (FEW + LATE)
    assert told.lost


def test_of_a_changed_chunk_only_that_one_is_lost(whole, tmp_path):
    with SessionFile(small_session(tmp_path / "w.mcap")) as session:
        chunk = session.chunks[2]
    raw = bytearray(whole)
    raw[chunk.at + chunk.length // 2] ^= 0x10
    told = saved(bytes(raw), tmp_path)
    assert [lost.at for lost in told.lost] == [chunk.at]
    assert told.n_messages >= FEW + LATE - 11


def test_two_files_in_one_are_both_saved(whole, tmp_path):
    told = saved(whole + whole, tmp_path)
    assert told.n_files == 2
    assert told.n_messages == 2 * (FEW + LATE)
    with pytest.raises(SessionError, match="session recover"):
        SessionFile(tmp_path / "broken.mcap")


def fuzz(whole, folder, n, seed):
    rng = np.random.default_rng(seed)
    n_saved = 0
    for _ in range(n):
        raw = bytearray(whole)
        for _ in range(int(rng.integers(1, 5))):
            kind = int(rng.integers(4))
            at = int(rng.integers(len(raw))) if raw else 0
            if kind == 0:
                del raw[at:]
            elif kind == 1 and raw:
                raw[at] ^= 1 << int(rng.integers(8))
            elif kind == 2:
                raw[at:at] = bytes(rng.integers(0, 256, int(rng.integers(1, 40)), dtype=np.uint8))
            else:
                raw += whole[at : at + int(rng.integers(1, 4000))]
        n_saved += saved(bytes(raw), folder) is not None
        try:
            with SessionFile(folder / "broken.mcap") as session:
                list(session.raw())
                session.metadata()
                [session.attachment(a.name) for a in session.attachments()]
        except SessionError:
            pass
    return n_saved


def test_fuzzed_files_are_saved_or_refused_in_words(whole, tmp_path):
    assert fuzz(whole, tmp_path, 40, seed=1) > 10


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_ten_thousand_fuzzed_files_are_saved_or_refused_in_words(whole, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fdatasync", lambda _fd: None)  # which takes most of the time, and no part in this
    assert fuzz(whole, tmp_path, 10_000, seed=2) > 5_000


RECORDER = """
import sys, time
from pathlib import Path
from robot.bus.topics import VERDICT
from robot.messages import Outcome, Verdict
from robot.recording.recorder import Recorder
from robot.recording.sink import Sink
from robot.recording.topics import LANES, RECORDED
recorder = Recorder(Sink(Path(sys.argv[1]), may_wait=False), lanes=LANES)
recorder.prepare(RECORDED)
begun, n = time.monotonic_ns(), 0
while True:
    now = time.monotonic_ns()
    recorder.write(VERDICT, Verdict(stamp_ns=now, sequence=n, outcome=Outcome.PASSED), log_ns=now)
    n += 1
    if n % 20 == 0:
        print(now, flush=True)
    time.sleep(0.002)
"""


def kill_one(folder, after_s):
    """Kill a recorder at an instant and return how much of what it was handed is lost, seconds."""
    path = folder / f"killed-{after_s:.4f}.mcap"
    command = [sys.executable, "-c", RECORDER, str(path)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(after_s)
        os.kill(process.pid, signal.SIGKILL)
        told = process.stdout.read().split()
    newest_ns = int(told[-1]) if told else 0
    out = path.with_suffix(".saved.mcap")
    try:
        saved_until_ns = recover(path, out).end_ns
    except SessionError:
        return after_s  # less than a chunk was there
    assert n_messages(out) > 0
    return (newest_ns - saved_until_ns) / 1e9


@pytest.mark.slow
@pytest.mark.realtime
def test_a_recorder_that_is_killed_at_any_instant_loses_a_second_at_most(tmp_path):
    rng = np.random.default_rng(4)
    lost_s = [kill_one(tmp_path, float(after_s)) for after_s in rng.uniform(0.2, 3.0, 100)]
    print("lost at most", max(lost_s), "s, middle", sorted(lost_s)[50], "s")  # noqa: T201 - shown by -rP
    assert max(lost_s) <= 1.0, lost_s
