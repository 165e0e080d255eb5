"""A replay over a wire begins where the epoch began, on a way that is safe, and is refused for what is another arm."""

import msgspec
import pytest

from config.loader import resolve
from robot.as_came import as_came
from robot.bus.topics import ARM_STATE, PERCEPT
from robot.errors import SafetyError
from robot.messages import Heading, Hold, JointTarget
from robot.recording.errors import UnfitError
from robot.recording.messages import Asked, Purpose, ResetMark
from robot.recording.origin import resolved_of
from robot.recording.recorder import Recorder
from robot.recording.recording import Recording
from robot.recording.replay_to_wire import APPROACH_RAD_S, NEAR_RAD, approach, epochs_in, replay_to_wire
from robot.recording.session_file import SessionFile
from robot.recording.sink import Sink
from robot.recording.topics import INTENT, LANES, RESET_MARK
from tests.support.stations import arm_state, engaged, percept

Q = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
THERE = (0.6, -1.2, 1.4, -1.7, -1.5, 0.3)
S = 1_000_000_000


@pytest.fixture(scope="module")
def spec():
    station, _ = engaged()
    return station.spec


def test_the_way_to_the_beginning_goes_up_first_then_over_no_faster_than_the_pace(spec):
    way = []
    with pytest.raises(SafetyError, match="within"):
        way.extend(approach(Q, THERE, spec))
    way = list(_until_raised(approach(Q, THERE, spec)))
    ups = [intent for intent in way if isinstance(intent, Heading)]
    overs = [intent.q_rad for intent in way if isinstance(intent, JointTarget)]
    assert way[: len(ups)] == ups, "up comes first"
    assert {(up.distance_m, up.height_m) for up in ups} == {(0.0, spec.heights_m[1])}
    steps = [max(abs(b - a) for a, b in zip(p, q, strict=True)) for p, q in zip([Q, *overs], overs, strict=False)]
    assert max(steps) <= APPROACH_RAD_S * spec.step_s * 1.001
    assert overs[-1] == pytest.approx(THERE)


def _until_raised(intents):
    try:
        yield from intents
    except SafetyError:
        return


@pytest.mark.parametrize(("off_rad", "is_way"), [(0.0, False), (0.99 * NEAR_RAD, False), (1.01 * NEAR_RAD, True)])
def test_an_arm_that_is_there_already_is_not_moved(spec, off_rad, is_way):
    there = (Q[0] + off_rad, *Q[1:])
    assert (next(approach(Q, there, spec), None) is not None) is is_way


def test_an_epoch_is_where_its_joints_were_at_each_percept(tmp_path):
    path = tmp_path / "session.mcap"
    recorder = Recorder(Sink(path, may_wait=True), lanes=LANES)
    recorder.write(RESET_MARK, ResetMark(seed=3, epoch=5, purpose=Purpose.DRIVE), log_ns=0)
    for k in range(200):  # ticks of 10 ms, time steps of 100 ms
        at = k * S // 100
        recorder.write(ARM_STATE, arm_state((k / 100, *Q[1:]), stamp_ns=at), log_ns=at)
        if k % 10 == 0:
            recorder.write(PERCEPT, percept({}, tcp_m=(0.0, 0.0, 0.0), stamp_ns=at), log_ns=at)
            intent = Hold() if k < 50 else as_came("nonsense")  # which ends what can be replayed
            recorder.write(INTENT, Asked(intent=intent, duration_s=0.1), log_ns=at)
    recorder.close()
    with SessionFile(path) as session:
        (epoch,) = epochs_in(session)
    assert (epoch.mark.seed, epoch.mark.epoch, epoch.start_rad[0], len(epoch.asked)) == (3, 5, 0.0, 5)
    assert [q[0] for q in epoch.ends_rad] == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5])


def test_an_epoch_that_begins_where_no_tick_was_yet_begins_at_the_first_one(tmp_path):
    path = tmp_path / "session.mcap"
    recorder = Recorder(Sink(path, may_wait=True), lanes=LANES)
    recorder.write(ARM_STATE, arm_state(THERE, stamp_ns=0), log_ns=0)  # where the epoch before ended
    recorder.write(RESET_MARK, ResetMark(seed=3, epoch=5, purpose=Purpose.DRIVE), log_ns=1)
    for k in range(3):
        at = 2 * S + k * S // 10
        recorder.write(PERCEPT, percept({}, tcp_m=(0.0, 0.0, 0.0), stamp_ns=at), log_ns=at)
        recorder.write(ARM_STATE, arm_state(Q, stamp_ns=at + S // 500), log_ns=at + S // 500)
        recorder.write(INTENT, Asked(intent=Hold()), log_ns=at + S // 400)
    recorder.close()
    with SessionFile(path) as session:
        (epoch,) = epochs_in(session)
    assert epoch.start_rad == Q


def a_session_of(path, rig, scenario="paper"):
    Recording(path, resolve(rig=rig, scenario=scenario, learning="default"), purpose=Purpose.DRIVE, seed=1).close()
    return path


@pytest.mark.parametrize(
    ("recorded_on", "rig", "why"),
    [("twin", None, "--to twin"), ("twin", "virtual_lab", "that recorded it"), ("virtual_lab", "twin", "recorded it")],
)
def test_only_the_virtual_arm_that_recorded_a_session_is_moved_by_it(tmp_path, recorded_on, rig, why):
    path = a_session_of(tmp_path / "run.mcap", recorded_on)
    with pytest.raises(UnfitError, match=why):
        replay_to_wire(path, rig=rig)


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        (
            lambda r: {"arm": msgspec.structs.replace(r.arm, tool=msgspec.structs.replace(r.arm.tool, stroke_m=0.05))},
            "arm",
        ),
        (lambda r: {"scenario": msgspec.structs.replace(r.scenario, name="other")}, "scenario"),
        (lambda r: {"cell": None}, "cell"),
        (lambda r: {"rig": msgspec.structs.replace(r.rig, camera=None)}, "camera and calibration"),
        (lambda r: {"rig": with_serial(r.rig, "4711")}, "4711"),
    ],
)
def test_another_tool_table_wiring_calibration_or_serial_is_refused(tmp_path, monkeypatch, changed, why):
    path = a_session_of(tmp_path / "run.mcap", "virtual_lab_camera")
    monkeypatch.setattr(
        "robot.recording.replay_to_arm.with_rig", lambda then, _: msgspec.structs.replace(then, **changed(then))
    )
    with pytest.raises(UnfitError, match=why):
        replay_to_wire(path, rig="anything")


def with_serial(rig, serial):
    return msgspec.structs.replace(rig, expected=msgspec.structs.replace(rig.expected, serial=serial))


def test_a_real_arm_is_not_moved_by_a_session(tmp_path, monkeypatch):
    path = a_session_of(tmp_path / "run.mcap", "virtual_lab")
    with SessionFile(path) as session:
        then = resolved_of(session)
    expected = msgspec.structs.replace(then.rig.expected, kind="real")
    real = msgspec.structs.replace(then, rig=msgspec.structs.replace(then.rig, expected=expected))
    monkeypatch.setattr("robot.recording.replay_to_arm.resolved_of", lambda _: real)
    with pytest.raises(UnfitError, match="not replayed to it"):
        replay_to_wire(path)
