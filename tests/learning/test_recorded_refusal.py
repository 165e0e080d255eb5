"""What was refused is in the session as it came, with the refusal."""

import math

from learning.assembly import RobotLearner
from robot.bus.topics import VERDICT
from robot.messages import Heading, Outcome
from robot.recording.checking import check
from robot.recording.messages import Purpose
from robot.recording.recording import Recording
from robot.recording.session_file import SessionFile
from robot.recording.topics import EVENT, INTENT, STEP
from tests.support.recorded import small_config


def test_an_intent_that_is_no_number_is_recorded_with_its_refusal_and_the_stop(tmp_path):
    path, config = tmp_path / "refused.mcap", small_config()
    recording = Recording(path, config, purpose=Purpose.LEARN, seed=0)
    learner = RobotLearner(config, seed=0, tap=recording.ticks)
    station = recording.station(learner.station)
    station.reset(seed=1, epoch=0)
    station.step(Heading(heading_rad=0.0, distance_m=0.02, height_m=0.2))
    assert station.step(Heading(heading_rad=math.nan, distance_m=0.02, height_m=0.2)).is_void
    learner.close()
    recording.close()
    with SessionFile(path) as session:
        asked = [message for _, _, message in session.messages(INTENT)]
        refused = [m for _, _, m in session.messages(VERDICT) if m.outcome is Outcome.REFUSED]
        (event,) = [message for _, _, message in session.messages(EVENT)]
        steps = [message for _, _, message in session.messages(STEP)]
        checked = check(session)
    assert [math.isnan(ask.intent.heading_rad) for ask in asked] == [False, True]
    (verdict,) = refused
    assert (verdict.reason, verdict.is_latched) == ("not_finite", True)
    assert event.what == "void, station latched"
    assert [step.is_void for step in steps] == [False, True]
    assert checked.is_sound, checked.findings
    assert "event" in [finding.kind for finding in checked.findings]
