"""A run on the twin that is recorded learns the same, makes the same file twice, and is lived through again."""

import re

import msgspec
import pytest

from learning.replaying import replay_to_learning
from robot.bus.topics import ARM_STATE, PERCEPT, REQUESTED, SENT, VERDICT
from robot.recording.cutting import cut, epochs_span
from robot.recording.errors import UnfitError
from robot.recording.replay_to_arm import replay_to_arm
from robot.recording.session_file import SessionFile
from robot.recording.topics import EPOCH, EVIDENCE, GOAL, STEP, SUBGOAL
from tests.support.recorded import learn_a_little
from tests.support.rewritten import with_changed


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("session") / "run.mcap"
    return path, learn_a_little(path)


def test_recording_changes_nothing_that_is_learnt(recorded):
    assert learn_a_little(None) == recorded[1]


def test_the_same_run_makes_the_same_file(recorded, tmp_path):
    again = tmp_path / "again.mcap"
    learn_a_little(again)
    assert again.read_bytes() == recorded[0].read_bytes()


def test_every_tick_has_its_request_what_was_sent_and_a_verdict(recorded):
    with SessionFile(recorded[0]) as session:
        found = {}
        for topic, _, message in session.messages(REQUESTED, SENT, VERDICT, ARM_STATE):
            found.setdefault(topic.name, []).append(message)
    assert [c.sequence for c in found[REQUESTED.name]] == [v.sequence for v in found[VERDICT.name]]
    assert found[REQUESTED.name] == found[SENT.name]
    stamps = {state.stamp_ns for state in found[ARM_STATE.name]}
    assert all(command.stamp_ns in stamps for command in found[SENT.name])


def test_decisions_lie_apart_from_ticks_so_that_learning_need_not_read_them(recorded):
    with SessionFile(recorded[0]) as session:
        lanes = [{session.topic_of(n) for n in chunk.index_at} for chunk in session.chunks]
    assert not [topics for topics in lanes if ARM_STATE.name in topics and PERCEPT.name in topics]


def test_an_epoch_is_told_from_its_goal_to_its_outcome(recorded):
    with SessionFile(recorded[0]) as session:
        told = [(topic.name, m) for topic, _, m in session.messages(GOAL, SUBGOAL, EVIDENCE, EPOCH)]
        n_steps = sum(1 for _ in session.messages(STEP))
    outcomes = [m for name, m in told if name == EPOCH.name]
    assert [m.epoch for name, m in told if name == GOAL.name] == [0, 1] == [m.epoch for m in outcomes]
    evidence = [m for name, m in told if name == EVIDENCE.name]
    assert len(evidence) == sum(outcome.n_trials for outcome in outcomes)
    assert sum(m.n_steps for m in evidence) <= n_steps


def test_the_replayed_learner_is_the_live_one_bit_for_bit(recorded):
    replayed, _ = replay_to_learning(recorded[0])
    assert replayed.is_identical, replayed.diverged
    assert replayed.sha256 == recorded[1]
    assert (replayed.n_epochs, replayed.n_compared) == (2, 2)


@pytest.mark.parametrize(
    ("bit", "what"),
    [(50, "the session has|to have fingerprint"), (0, "what is learnt is the same, but percepts")],
    ids=["of weight", "the last"],
)
def test_one_flipped_bit_in_one_percept_is_told(recorded, tmp_path, bit, what):
    changed = tmp_path / "changed.mcap"

    def flip(percept):
        place = percept["objects"][0]["position_m"]
        last = place[0]
        bits = int.from_bytes(msgspec.msgpack.encode(last)[1:], "big") ^ 1 << bit
        place[0] = msgspec.msgpack.decode(b"\xcb" + bits.to_bytes(8, "big"))
        return percept

    with_changed(recorded[0], changed, topic=PERCEPT.name, nth=5, change=flip)
    replayed, _ = replay_to_learning(changed)
    assert not replayed.is_identical
    assert re.search(what, replayed.diverged)


def test_commands_replayed_to_the_twin_that_recorded_them_go_where_they_went(recorded):
    done = replay_to_arm(recorded[0])
    assert done.is_same, done
    assert done.joint_error_rad == 0.0
    assert done.n_ticks > 100


def test_a_session_is_not_replayed_to_another_arm(recorded):
    with pytest.raises(UnfitError, match="expected the twin ur5e twin that recorded it, got virtual"):
        replay_to_arm(recorded[0], rig="virtual_lab")


def test_an_epoch_that_was_cut_out_is_replayed_to_the_twin_but_not_to_learning(recorded, tmp_path):
    out = tmp_path / "second.mcap"
    with SessionFile(recorded[0]) as session:
        span = epochs_span(session, 1, 1)
    cut(recorded[0], out, span=span)
    assert replay_to_arm(out).is_same
    replayed, _ = replay_to_learning(out)
    assert re.search("expected (epoch 0 next|a fingerprint after 0 epochs)", replayed.diverged)
