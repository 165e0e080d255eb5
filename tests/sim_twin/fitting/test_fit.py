import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner

from config.loader import load_arm, resolve
from robot.cli import app
from robot.recording.errors import UnfitError
from sim_twin.fitting.fit import Fit, fit_pieces, fit_sessions
from sim_twin.fitting.stream import pieces_of
from sim_twin.fitting.trial import Differing, Driven, differing, record_trial, trial_config
from sim_twin.plant import TwinPlant
from sim_twin.shadowing.beside import Bounds
from sim_twin.shadowing.session import shadow_session
from tests.support.fit_streams import RAISED_RAD, ticks_of_twin, waves

SEED = 950
ARM = load_arm("ur5e")


@pytest.fixture(scope="module")
def trial(tmp_path_factory):
    """A session of an arm that differs in everything, and what is true of it."""
    path = tmp_path_factory.mktemp("trial") / "trial.mcap"
    return path, record_trial(path, differing(np.random.default_rng([SEED, 1])), seed=SEED, seconds=4.0)


@pytest.fixture(scope="module")
def fitted(trial):
    folder = trial[0].parent / "fit"
    result = CliRunner().invoke(app, ["twin", "fit", str(trial[0]), "--out", str(folder), "--json"])
    assert result.exit_code == 0, result.output
    return folder, msgspec.json.decode(result.stdout.splitlines()[-1], type=Fit)


def test_what_was_injected_is_found(trial, fitted):
    _, truth = trial
    _, fit = fitted
    told = [row for row in (*fit.rows, *fit.lengths) if row.half is not None]
    inside = [abs(row.value - truth[row.name]) <= row.half for row in told]
    assert len(told) >= 40
    assert np.mean(inside) >= 0.9
    for row in told:  # none is off by more than twice what it says of itself
        assert abs(row.value - truth[row.name]) <= 2.0 * row.half, row
    assert fit.force_kg == pytest.approx(truth["payload"], abs=0.01)


def test_on_what_was_not_fitted_joints_are_within_a_milliradian(fitted):
    _, fit = fitted
    assert max(fit.after.worst_rad) < 1e-3 < 5e-3 < max(fit.before.worst_rad)
    assert fit.tool_after_m < 1e-6 < 1e-4 < fit.tool_before_m


def test_the_page_stands_alone(fitted):
    page = (fitted[0] / "report.html").read_text()
    assert "<svg" in page
    assert not any(word in page for word in ("<script", "<link", "src=", "@import"))
    assert all(f"<td>{row.name}</td>" in page for row in (*fitted[1].rows, *fitted[1].lengths))


def test_the_twin_loads_what_was_fitted(fitted):
    resolved = resolve(rig=fitted[0] / "rig.yaml")
    assert resolved.arm.fitted == fitted[1].plant
    plant = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
    friction = plant.world.model.dof_frictionloss[:6]
    assert friction == pytest.approx([fitted[1].row(f"friction {j.name}").value for j in resolved.arm.joints])


def test_a_shadow_of_the_fitted_twin_stays_with_the_arm_and_the_files_does_not(trial, fitted):
    path, _ = trial
    known = load_arm(fitted[0] / "arm.yaml").fitted
    worst = [0.0]

    def look(beside):
        if beside.apart is not None:
            worst[0] = max(worst[0], *map(abs, beside.apart.q_rad))

    beside = shadow_session(path, fitted=known, look=look)
    assert beside.latched is None
    assert beside.causes == ()
    assert worst[0] < 1e-3
    assert shadow_session(path, bounds=Bounds(q_rad=5e-3)).latched.what == "joints"


def test_nothing_is_overwritten_and_a_session_of_nothing_is_refused(trial, fitted):
    again = CliRunner().invoke(app, ["twin", "fit", str(trial[0]), "--out", str(fitted[0])])
    assert again.exit_code == 2
    assert "give another with --out" in again.output
    missing = CliRunner().invoke(app, ["twin", "fit", "nowhere.mcap"])
    assert missing.exit_code == 2
    assert "nowhere.mcap" in missing.output


def test_a_session_that_shows_too_little_is_refused_in_words(tmp_path):
    path = tmp_path / "short.mcap"
    record_trial(path, Differing(), seed=SEED, seconds=0.9)
    with pytest.raises(UnfitError, match=r"two seconds or more"):
        fit_sessions([path])


def test_what_the_session_does_not_tell_is_named_and_stays_about_where_it_was():
    joints = waves(np.add(ARM.home_rad, RAISED_RAD), n=250, tick_s=0.01)
    joints[:, 5] = joints[0, 5]
    pieces = pieces_of(ticks_of_twin(ARM, np.concatenate([joints, joints[::-1]]), tick_s=0.01), tick_s=0.01)
    rng = np.random.default_rng(SEED)
    pieces = [msgspec.structs.replace(p, q_rad=p.q_rad + rng.normal(0.0, 3e-4, p.q_rad.shape)) for p in pieces]
    fit = fit_pieces(ARM, pieces[:1], pieces[1:], physics_s=0.002)
    for kind in ("lag", "stiffness"):
        row = fit.row(f"{kind} wrist_3")
        assert row.half is None
        assert row.value == pytest.approx(row.before, rel=0.05)
        assert row.why
    assert fit.row("lag shoulder").half is not None
    assert abs(fit.row("lag shoulder").value - fit.row("lag shoulder").before) <= fit.row("lag shoulder").half


@pytest.mark.slow
def test_a_ramp_on_the_arm_trails_by_the_lag_that_a_fit_is_judged_by():
    by = msgspec.structs.replace(differing(np.random.default_rng([SEED + 1, 1])), noise_rad=0.0, payload_kg=0.0, mm=0.0)
    for joint in range(6):
        trailed = [_trailed_rad(by, joint, way) for way in (0.3, -0.3)]
        # Dry friction holds back either way. At ticks of one physics step the joints are read half a step early.
        lag_s = (trailed[0] - trailed[1]) / 0.6 - _dry_s(by, joint) + 0.001
        assert lag_s == pytest.approx(_truth(by)[f"lag {ARM.joints[joint].name}"], abs=2.5e-4)


def _truth(by):
    return Driven(trial_config(), by, seed=SEED).truth


def _dry_s(by, joint):
    truth = _truth(by)
    return by.friction_nm[joint] / truth[f"stiffness {ARM.joints[joint].name}"] / 0.3


def _trailed_rad(by, joint, speed_rad_s):
    driven = Driven(trial_config(), by, seed=SEED)
    t = 0.002 * np.arange(500)
    eased = np.where(t < 0.2, t * t / 0.4, t - 0.1)
    joints = np.tile(driven.home_rad, (500, 1))
    joints[:, joint] += speed_rad_s * eased
    off = []
    from tests.support.fit_streams import Heard

    driven.follow(joints, Heard(lambda state, command: off.append(command.q_rad[joint] - state.q_rad[joint])))
    return float(np.mean(off[-50:]))


@pytest.mark.slow
def test_the_bench_finds_what_was_injected():
    from sim_twin.fitting.bench import bench_fit

    results = {result.name: result for result in bench_fit(full=False).results}
    assert results["held_out_worst_mrad"].ok
    assert results["told_share"].value == 1.0
