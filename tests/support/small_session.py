"""A session of a few messages, made without any arm."""

from robot.bus.topics import VERDICT
from robot.messages import Outcome, Verdict
from robot.recording.messages import Event
from robot.recording.recorder import Recorder
from robot.recording.sink import Sink
from robot.recording.topics import EVENT, LANES

__all__ = ["FEW", "LATE", "small_session"]

FEW, LATE = 60, 10
"""Verdicts and events."""


def small_session(path, *, more=(), tell=lambda _: None, step_ns=100_000_000):
    """Write one and return its path."""
    recorder = Recorder(Sink(path, may_wait=True), lanes=LANES, tell=tell)
    recorder.note("session", {"format": "1", "serial": "a", "scenario": "b", "clock": "arm"})
    recorder.attach("config.yaml", "application/yaml", b"nothing: 1\n")
    for n in range(FEW):
        at = n * step_ns
        verdict = Verdict(stamp_ns=at, sequence=n, outcome=Outcome.PASSED)
        recorder.write(VERDICT, verdict, log_ns=at, stamp_ns=at)
        if n % (FEW // LATE) == 0:
            recorder.write(EVENT, Event(what=f"event {n}"), log_ns=at)
    for topic, message in more:
        recorder.write(topic, message, log_ns=FEW * step_ns)
    recorder.close()
    return path
