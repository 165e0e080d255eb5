"""Sessions that were recorded once and lie here: what was made of them then is made of them now.

Bit for bit only with the versions and on the kind of processor that recorded them; elsewhere what does not hang on the
last bit is compared. tests/replay/make.py makes them anew, after a change that is meant.
"""

import msgspec
import pytest

from config.loader import resolve
from learning.demonstrations import shown_in
from learning.goals import GoalJudge
from learning.interfaces import TrialOutcome
from learning.replaying import replay_to_learning
from robot.bench import bench_report
from robot.bus.topics import PERCEPT
from robot.recording.checking import check
from robot.recording.origin import resolved_of
from robot.recording.recording import VERSIONS
from robot.recording.replay_to_arm import replay_to_arm
from robot.recording.session_file import SessionFile
from robot.recording.topics import EVIDENCE, STATION
from tests.replay.make import LEARNT, SHOWN

MOST_BYTES = 400_000
NEAR_RAD = 1e-3


@pytest.fixture(params=[LEARNT, SHOWN], ids=["learnt", "shown"])
def shipped(request):
    return request.param


def is_as_recorded(path):
    """Whether versions and processor are those that a session was recorded with."""
    with SessionFile(path) as session:
        then = msgspec.json.decode(session.attachment(VERSIONS))
    now = bench_report("here", (), seconds=0.0)
    alike = ("mujoco", "torch", "numpy", "placo", "ruckig")
    return then["machine"]["cpu"] == now.machine["cpu"] and all(
        then["versions"][name] == now.versions[name] for name in alike
    )


def test_a_shipped_session_is_small_and_sound(shipped):
    assert shipped.stat().st_size < MOST_BYTES
    with SessionFile(shipped) as session:
        checked = check(session)
    assert checked.is_sound, checked.findings


def test_motion_and_gate_make_of_its_intents_what_they_made_then(shipped):
    done = replay_to_arm(shipped)
    assert done.n_ticks > 50
    assert done.joint_error_rad <= (1e-9 if is_as_recorded(shipped) else NEAR_RAD)


def test_the_learner_makes_of_its_percepts_what_it_made_then():
    replayed, _ = replay_to_learning(LEARNT)
    if is_as_recorded(LEARNT):
        assert replayed.is_identical, replayed.diverged
    assert replayed.n_steps > 10


def test_goals_are_judged_on_its_percepts_as_they_were():
    with SessionFile(LEARNT) as session:
        resolved = resolved_of(session)
        (mark,) = [mark for _, _, mark in session.messages(STATION)]
        judge = GoalJudge(resolved.scenario, mark.spec)
        told = [m for _, _, m in session.messages(EVIDENCE)]
        held = [judge.achieved(percept) for _, _, percept in session.messages(PERCEPT)]
    came_about = {g for state in held for g, is_held in enumerate(state) if is_held}
    assert came_about == {g for evidence in told for g, is_on in enumerate(evidence.state_after) if is_on}


def test_what_was_shown_in_it_is_found_in_it():
    scenario = resolve(rig="twin", scenario="paper").scenario
    with SessionFile(SHOWN) as session:
        (mark,) = [mark for _, _, mark in session.messages(STATION)]
        percepts = [percept for _, _, percept in session.messages(PERCEPT)]
    shown = list(shown_in(percepts, GoalJudge(scenario, mark.spec), epoch=0, step_s=mark.spec.step_s))
    achieved = [s for s in shown if s.attempt.outcome is TrialOutcome.ACHIEVED]
    assert 0 in [s.attempt.subgoal for s in achieved]
    assert all(len(s.distances_m) > 10 for s in achieved)
