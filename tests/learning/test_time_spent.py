"""Where a run's time went is kept over all its sessions, and a session that runs no epoch leaves it as it is."""

import itertools
import json
from time import perf_counter

import pytest

from learning.progress import Progress
from learning.run_folder import RunFolder
from learning.session import open_session
from learning.stopwatch import Stopwatch
from learning.time_spent import TimeSpent
from learning.wanted import Wanted

QUICK = "name: quick\nexperiment: {epochs: 6, trials: 1, steps: 5, test_epochs: 1, checkpoint_every: 1}\n"


def test_times_add_up_layer_by_layer():
    first = TimeSpent(seconds=3.0, n_decisions=10, seconds_by_layer={"stack": 2.0, "physics": 1.0})
    second = TimeSpent(seconds=1.0, n_decisions=30, seconds_by_layer={"stack": 0.5, "records": 0.5})
    both = first + second
    assert (both.seconds, both.n_decisions) == (4.0, 40)
    assert both.seconds_by_layer == {"stack": 2.5, "physics": 1.0, "records": 0.5}
    assert both.us_per_decision_by_layer["stack"] == pytest.approx(62_500.0)
    assert first.seconds_by_layer == {"stack": 2.0, "physics": 1.0}


def run_session(path, preset, should_stop=lambda: False):
    with RunFolder(path) as folder:
        wanted = Wanted(rig="fake", preset=str(preset))
        session = open_session(folder, wanted, resume=True, stopwatch=Stopwatch(perf_counter))
        try:
            progress = Progress(goals="abcdef", n_epochs=6, n_done=session.n_done, now_s=perf_counter)
            return session.run(progress, n_workers=0, should_stop=should_stop)
        finally:
            session.close()


def interrupted_after(n_epochs):
    asked = itertools.count()

    def should_stop():
        if next(asked) == n_epochs:
            raise KeyboardInterrupt
        return False

    return should_stop


def n_steps(path):
    return sum(row.n_steps for row in RunFolder(path).goals())


def test_sessions_that_were_stopped_or_cut_off_count_and_one_without_an_epoch_does_not(tmp_path):
    out, preset = tmp_path / "run", tmp_path / "quick.yaml"
    preset.write_text(QUICK)
    profile = out / "profile.json"
    stops = iter([False, False, True])
    assert run_session(out, preset, lambda: next(stops)).n_done == 2
    stopped = json.loads(profile.read_text())
    assert stopped["n_decisions"] == n_steps(out) > 0
    with pytest.raises(KeyboardInterrupt):
        run_session(out, preset, interrupted_after(2))
    cut_off = json.loads(profile.read_text())
    assert cut_off["n_decisions"] == n_steps(out) > stopped["n_decisions"]
    ended = run_session(out, preset)
    whole = json.loads(profile.read_text())
    assert whole["n_decisions"] == ended.spent.n_decisions == n_steps(out)
    assert whole["seconds"] > cut_off["seconds"] > stopped["seconds"]
    assert all(whole["seconds_by_layer"][name] >= s for name, s in cut_off["seconds_by_layer"].items())
    raw = profile.read_bytes()
    assert run_session(out, preset).spent == ended.spent
    assert profile.read_bytes() == raw
