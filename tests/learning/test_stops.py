"""What stopped the arm in a run is kept by kind, over all its sessions, and told."""

import json
from time import perf_counter

import pytest

from learning.progress import Progress
from learning.report import group_runs, load_run, report_of
from learning.run_folder import RunFolder
from learning.session import open_session
from learning.stops import Stops, kind_of, stops_of
from learning.stopwatch import Stopwatch
from learning.telling import summary_lines
from learning.wanted import Wanted

QUICK = "name: quick\nexperiment: {epochs: 4, trials: 1, steps: 3, test_epochs: 1, checkpoint_every: 1}\n"


@pytest.mark.parametrize(
    ("reason", "kind"),
    [
        ("arm_mode: expected a running arm, it is protective_stop", "protective_stop"),
        ("arm_refused: servoJ: the controller did not take it: protective stop", "protective_stop"),
        ("arm_mode: expected a running arm, it is emergency_stop", "emergency_stop"),
        ("arm_mode: expected a running arm, it is stopped", "arm_mode"),
        ("stale_intent: expected the next intent within 200 ms", "stale_intent"),
        ("stopped by a person", "stopped by a person"),
    ],
)
def test_a_stop_of_the_arms_own_is_told_by_its_name_and_a_refusal_by_its_reason(reason, kind):
    assert kind_of(reason) == kind


def test_stops_add_up_and_are_told_in_a_thousand_epochs():
    first = stops_of(["arm_mode: it is protective_stop", "tracking: by much"], n_epochs=300)
    both = first + stops_of(["arm_mode: it is protective_stop"], n_epochs=700)
    assert both == Stops(n_epochs=1000, n_by_kind={"protective_stop": 2, "tracking": 1})
    assert both.protective_per_1000_epochs == 2.0
    assert both.line() == (
        "stops in 1000 epochs (in a thousand): protective 2 (2.0); all 3, protective_stop 2 (2.0), tracking 1 (1.0)"
    )
    assert Stops().protective_per_1000_epochs == 0.0


def run_session(path, preset, *, n_epochs):
    with RunFolder(path) as folder:
        wanted = Wanted(rig="fake", preset=str(preset))
        session = open_session(folder, wanted, resume=True, stopwatch=Stopwatch(perf_counter))
        try:
            progress = Progress(goals="abcdef", n_epochs=4, n_done=session.n_done, now_s=perf_counter)
            session.run(progress, n_workers=0, should_stop=lambda: progress._n_done >= n_epochs)
        finally:
            session.close()


def test_a_run_keeps_its_stops_over_its_sessions_and_its_summary_and_report_tell_them(tmp_path):
    preset, path = tmp_path / "quick.yaml", tmp_path / "run"
    preset.write_text(QUICK)
    run_session(path, preset, n_epochs=2)
    folder = RunFolder(path)
    kept = folder.stops()
    assert (kept.n_epochs, kept.n_by_kind) == (2, {})
    folder.keep_stops(stops_of(["arm_mode: it is protective_stop"], n_epochs=kept.n_epochs))
    run_session(path, preset, n_epochs=4)
    kept = folder.stops()
    n_tests = sum(row.n_all for row in folder.evaluations())
    assert (kept.n_epochs, kept.n_by_kind) == (4 + n_tests, {"protective_stop": 1})
    tree = json.loads((path / "stops.json").read_text())
    assert tree["protective_per_1000_epochs"] == pytest.approx(1000 / kept.n_epochs)
    run = load_run(folder)
    assert f"protective 1 ({1000 / kept.n_epochs:.1f})" in list(summary_lines(run))[-1]
    report = report_of(group_runs([run]))
    assert report.stops == ((str(path), kept),)
    assert report.protective_per_1000_epochs == kept.protective_per_1000_epochs


def test_a_run_that_kept_no_stops_is_told_without_them(tmp_path):
    preset, path = tmp_path / "quick.yaml", tmp_path / "run"
    preset.write_text(QUICK)
    run_session(path, preset, n_epochs=1)
    (path / "stops.json").unlink()
    run = load_run(RunFolder(path))
    assert run.stops is None
    assert not any("stops in" in line for line in summary_lines(run))
    assert report_of(group_runs([run])).protective_per_1000_epochs is None
