"""The dataset doctor tells what was done to a session, and says nothing of one that nothing was done to."""

import msgspec
import pytest
from typer.testing import CliRunner

from robot.bus.topics import ARM_STATE, PERCEPT, SENT
from robot.messages import Executed, Hold
from robot.recording.checking import check
from robot.recording.cli import app
from robot.recording.cutting import cut, merge
from robot.recording.errors import UnfitError
from robot.recording.messages import Asked, StepMark
from robot.recording.recorder import Recorder
from robot.recording.session_file import SessionFile
from robot.recording.sink import Sink
from robot.recording.topics import EPOCH, INTENT, LANES, STEP
from tests.support.recorded import learn_a_little
from tests.support.rewritten import with_changed
from tests.support.stations import arm_state


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    path = tmp_path_factory.mktemp("sound") / "run.mcap"
    learn_a_little(path, n_epochs=1)
    return path


def kinds(path):
    with SessionFile(path) as session:
        checked = check(session)
    return {finding.kind for finding in checked.findings if finding.severity == "error"}


def test_a_sound_session_has_no_errors(sound):
    assert kinds(sound) == set()


def test_a_measurement_that_is_missing_is_no_gap_but_a_tenth_of_a_second_is(sound, tmp_path):
    end = 1.0
    first = tmp_path / "first.mcap"
    cut(sound, first, span=(0, int(end * 1e9)))
    second = tmp_path / "second.mcap"
    cut(sound, second, span=(int((end + 0.1) * 1e9), 1 << 63))
    whole = tmp_path / "gap.mcap"
    merge([first, second], whole)
    assert "gap" in kinds(whole)
    one = with_changed(sound, tmp_path / "one.mcap", topic=ARM_STATE.name, nth=20)
    assert "gap" not in kinds(one)


def test_a_stamp_that_goes_back_is_told(sound, tmp_path):
    def back(message):
        return {**message, "stamp_ns": message["stamp_ns"] - 100_000_000}

    assert "stamps go back" in kinds(with_changed(sound, tmp_path / "s.mcap", topic=PERCEPT.name, nth=10, change=back))


def test_an_epoch_without_outcome_is_told(sound, tmp_path):
    assert kinds(with_changed(sound, tmp_path / "s.mcap", topic=EPOCH.name, nth=1)) == {"no outcome"}


def test_an_intent_without_its_step_is_told(sound, tmp_path):
    once = with_changed(sound, tmp_path / "once.mcap", topic=STEP.name, nth=4)
    assert "asked, not carried out" in kinds(with_changed(once, tmp_path / "twice.mcap", topic=STEP.name, nth=4))


def test_a_missing_attachment_is_told(sound, tmp_path):
    path = with_changed(sound, tmp_path / "s.mcap", topic="", nth=0, leave_out=("config.yaml",))
    assert kinds(path) == {"missing attachment"}


def test_joints_that_stand_still_while_they_are_told_to_move_are_told(sound, tmp_path):
    frozen = []

    def freeze(message):
        frozen.append(message)
        return {**frozen[0], "stamp_ns": message["stamp_ns"]}

    path = sound
    with SessionFile(sound) as session:
        states = [m for _, _, m in session.messages(ARM_STATE)]
        moved = [m for _, _, m in session.messages(SENT)]
    assert max(abs(a - b) for a, b in zip(moved[5].q_rad, moved[70].q_rad, strict=True)) > 1e-3
    path = every_changed(sound, tmp_path / "s.mcap", ARM_STATE.name, freeze, after=states[8].stamp_ns)
    assert kinds(path) == {"frozen"}


def every_changed(path, out, topic, change, *, after):
    from robot.recording.records import AttachedRecord, MetadataRecord
    from robot.recording.rewriting import Rewriting

    with SessionFile(path) as session:
        rewriting = Rewriting(out)
        for name, values in session.metadata().items():
            rewriting.note(MetadataRecord(name, values))
        for a in session.attachments():
            rewriting.attach(
                AttachedRecord(a.log_ns, a.create_ns, a.name, a.media_type, session.attachment(a.name))
            )  # fmt: skip
        for raw in session.raw():
            channel = session.channels[raw.channel]
            payload = raw.payload
            if channel.topic == topic and raw.publish_ns > after:
                payload = msgspec.json.encode(change(msgspec.json.decode(payload)))
            number = rewriting.channel(channel, session.schemas.get(channel.schema))
            rewriting.message(number, channel.topic, raw.log_ns, raw.publish_ns, payload)
        rewriting.close()
    return out


def test_two_halves_merged_are_the_whole(sound, tmp_path):
    halves = [tmp_path / "a.mcap", tmp_path / "b.mcap"]
    with SessionFile(sound) as session:
        middle = session.statistics.end_ns // 2
        wanted = [(session.topic_of(raw.channel), raw[2:]) for raw in session.raw()]
    cut(sound, halves[0], span=(0, middle + 100_000_000))
    cut(sound, halves[1], span=(middle, 1 << 63))
    merge(halves, tmp_path / "whole.mcap")
    with SessionFile(tmp_path / "whole.mcap") as session:
        found = [(session.topic_of(raw.channel), raw[2:]) for raw in session.raw()]
    assert sorted(found) == sorted(wanted)


def test_a_cut_of_a_topic_that_is_not_there_names_those_that_are(sound, tmp_path):
    with pytest.raises(UnfitError, match=r"expected topics of arm/state, .* got nothing"):
        cut(sound, tmp_path / "s.mcap", span=(0, 1), topics=["nothing"])


def test_the_command_says_by_its_exit_code_whether_a_session_is_sound(sound, tmp_path):
    runner = CliRunner()
    assert runner.invoke(app, ["check", str(sound)]).exit_code == 0
    broken = with_changed(sound, tmp_path / "s.mcap", topic=EPOCH.name, nth=1)
    told = runner.invoke(app, ["check", str(broken), "--json"])
    assert told.exit_code == 1
    assert [f["kind"] for f in msgspec.json.decode(told.output)["findings"]] == ["no outcome"]
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(sound.read_bytes()[:-1000])
    told = runner.invoke(app, ["check", str(torn)])
    assert told.exit_code == 1
    saved = tmp_path / "saved.mcap"
    assert runner.invoke(app, ["recover", str(torn), "-o", str(saved)]).exit_code == 0
    told = runner.invoke(app, ["info", str(saved), "--json"])
    assert msgspec.json.decode(told.output)["about"]["scenario"] == "paper"


def test_a_session_is_drawn(sound, tmp_path):
    picture = tmp_path / "s.png"
    assert CliRunner().invoke(app, ["view", str(sound), "-o", str(picture), "--to", "1"]).exit_code == 0
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(("asked_in_between", "kinds"), [(False, set()), (True, {"gap"})])
def test_an_arm_on_a_wire_that_is_asked_nothing_need_not_tick(tmp_path, asked_in_between, kinds):
    path = tmp_path / "wire.mcap"
    recorder = Recorder(Sink(path, may_wait=True), lanes=LANES)
    recorder.note("session", {"clock": "host"})
    ms = 1_000_000
    step = StepMark(
        executed=Executed(duration_s=0.05, moved_m=(0.0,) * 3, target_m=(0.0,) * 3), verdicts=(), is_void=False
    )
    for k in range(400):  # ticks of 2 ms, a time step each 50 ms; two seconds without either in the middle
        at = k * 2 * ms + (2000 * ms if k >= 200 else 0)
        recorder.write(ARM_STATE, arm_state((0.0,) * 6, stamp_ns=at), log_ns=at)
        if k % 25 == 0:
            recorder.write(INTENT, Asked(intent=Hold()), log_ns=at)
        if k % 25 == 24:
            recorder.write(STEP, step, log_ns=at)
    if asked_in_between:
        recorder.write(INTENT, Asked(intent=Hold()), log_ns=1000 * ms)
        recorder.write(STEP, step, log_ns=1050 * ms)
    recorder.close()
    with SessionFile(path) as session:
        assert {f.kind for f in check(session).findings if f.topic == ARM_STATE.name} == kinds
