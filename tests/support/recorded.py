"""A short run on the twin, recorded: made once, shared by the tests that need one."""

from functools import cache
from pathlib import Path

import msgspec

from config.loader import resolve
from learning.assembly import RobotLearner
from learning.fingerprint import fingerprint
from learning.recorded import RecordedDecisions
from learning.seeds import reset_seed
from robot.recording.messages import Purpose
from robot.recording.recording import Recording

__all__ = ["learn_a_little", "small_config"]


@cache
def small_config(n_trials=2, n_steps=12):
    """Return the paper's table with a learner that takes short trials."""
    resolved = resolve(rig="twin", scenario="paper", learning="default")
    experiment = msgspec.structs.replace(resolved.learning.experiment, trials=n_trials, steps=n_steps)
    learning = msgspec.structs.replace(resolved.learning, experiment=experiment)
    return msgspec.structs.replace(resolved, learning=learning)


def learn_a_little(path: Path | None, *, n_epochs=2, seed=3, config=None):
    """Learn a few epochs, recorded where a file is named, and return the fingerprint of what was learnt."""
    resolved = small_config() if config is None else config
    recording = None
    if path is not None:
        recording = Recording(path, resolved, purpose=Purpose.LEARN, seed=seed, about={"n_done": "0"})
    learner = RobotLearner(resolved, seed=seed, tap=None if recording is None else recording.ticks)
    agent, station, heard = learner.agent, learner.station, None
    if recording is not None:
        station = recording.station(station)
        heard = RecordedDecisions(recording, [g.name for g in resolved.scenario.goals])
        agent.witness = heard
    for epoch in range(n_epochs):
        agent.learn_epoch(station, epoch=epoch, seed=reset_seed(seed, epoch), goal=agent.choose_goal())
        if heard is not None:
            heard.captured(epoch + 1, agent)
    learner.close()
    if recording is not None:
        recording.close()
    return fingerprint(agent.state_dict())
