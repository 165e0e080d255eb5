from pathlib import Path

import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner

from config.loader import load_arm
from robot.cli import app
from robot.messages import ArmMode, ObjectPercept, Percept
from sim_twin.fitted import nominal_plant
from sim_twin.fitting.trial import Differing, Driven, trial_config
from sim_twin.plant import TwinTruth
from sim_twin.shadowing.beside import Bounds, TwinBeside
from sim_twin.shadowing.session import shadow_session
from tests.support.fit_streams import Heard

SEED, SECONDS = 960, 3.0
SHIPPED = Path(__file__).parents[2] / "replay" / "learnt.mcap"
DRAGS = tuple(float(8 * (i == 2)) for i in range(6))


def followed(*, bounds=None, **different):
    """Return a twin by the files beside a virtual arm that differs from them."""
    config = trial_config()
    driven = Driven(config, Differing(**different), seed=SEED)
    beside = TwinBeside(config, bounds=bounds)
    driven.follow(driven.moves(np.random.default_rng([SEED, 3]), SECONDS), Heard(beside.take))
    return beside


def percept_of(driven):
    """Return what somebody sees of the arm's table."""
    things = tuple(
        ObjectPercept(name=t.name, position_m=t.position_m, quat=t.quat, age_s=0.0, is_valid=True)
        for t in TwinTruth(driven.robot.machine.world).read().objects
    )
    state = driven.measure()
    return Percept(
        stamp_ns=state.stamp_ns, distances_m=(), button_states=(), ages_s=(), valid=(), objects=things,
        tcp_position_m=state.tcp_position_m, grip=state.grip, is_in_contact=False,
    )  # fmt: skip


def kinds(beside):
    return [(cause.kind, cause.joint) for cause in beside.causes]


def test_of_an_arm_that_is_as_its_file_nothing_is_named():
    beside = followed()
    assert (beside.causes, beside.latched) == ((), None)
    assert beside.n_compared > 1000
    assert max(map(abs, beside.apart.q_rad)) < 2e-4


def test_a_payload_that_a_person_forgot_to_set_is_named():
    (cause,) = followed(payload_kg=1.0).causes
    assert (cause.kind, cause.joint) == ("payload", "")
    assert cause.amount == pytest.approx(1.0, abs=0.1)
    assert "was a payload not set?" in cause.text


def test_a_joint_that_drags_is_named():
    (cause,) = followed(friction_nm=DRAGS).causes
    assert (cause.kind, cause.joint) == ("friction", "elbow")
    assert cause.amount == pytest.approx(8.0, abs=1.0)
    assert "elbow drags" in cause.text


@pytest.mark.slow
def test_both_at_once_are_told_apart():
    assert sorted(kinds(followed(payload_kg=1.5, friction_nm=DRAGS))) == [("friction", "elbow"), ("payload", "")]


@pytest.mark.slow
@pytest.mark.parametrize("joint", range(6))
def test_each_joint_that_drags_is_named_alone(joint):
    heavy = 8.0 if joint < 3 else 2.0
    (cause,) = followed(friction_nm=tuple(heavy * (i == joint) for i in range(6))).causes
    assert (cause.kind, cause.joint) == ("friction", load_arm("ur5e").joints[joint].name)
    assert cause.amount == pytest.approx(heavy, rel=0.2)


def test_a_bound_latches_once_and_says_what_it_looks_like():
    beside = followed(payload_kg=1.0, bounds=Bounds(q_rad=5e-4))
    latched = beside.latched
    assert latched.what == "joints"
    assert "0.5 allowed" in latched.text
    beside.release()
    assert beside.latched is None


def test_of_the_twin_that_recorded_it_a_shadow_is_the_same_table_and_all():
    worst = [0.0]

    def look(beside):
        if beside.apart is not None:
            worst[0] = max(worst[0], *map(abs, beside.apart.q_rad), *map(abs, beside.apart.tcp_m))
            assert beside.apart.inputs == 0

    beside = shadow_session(SHIPPED, look=look)
    assert worst[0] <= 1e-9
    assert beside.n_compared > 100
    assert beside.n_begun == 4  # where the arm was placed, and where its table was seen


def test_an_input_that_is_not_the_twins_latches():
    config = trial_config()
    driven = Driven(config, Differing(), seed=SEED)
    beside = TwinBeside(config, bounds=Bounds(inputs_s=0.05))
    moves = driven.moves(np.random.default_rng([SEED, 3]), 1.5)
    beside.see(percept_of(driven))

    def stuck(state, command):
        beside.take(msgspec.structs.replace(state, digital_in=state.digital_in | 1), command)

    driven.follow(moves[:400], Heard(beside.take))
    assert beside.apart.inputs == 0
    driven.follow(moves[400:], Heard(stuck))
    assert beside.latched.what == "inputs"


def test_after_a_stop_or_a_placing_it_begins_anew():
    config = trial_config()
    driven = Driven(config, Differing(), seed=SEED)
    beside = TwinBeside(config)
    ticks = []
    driven.follow(driven.moves(np.random.default_rng([SEED, 3]), 1.2), Heard(lambda *tick: ticks.append(tick)))
    for state, command in ticks[:100]:
        beside.take(state, command)
    beside.take(msgspec.structs.replace(ticks[100][0], mode=ArmMode.PROTECTIVE_STOP), ticks[100][1])
    beside.take(*ticks[101])
    assert beside.n_begun == 2
    beside.take(*ticks[550])  # 0.9 s later
    assert beside.n_begun == 3
    beside.begin_anew()
    beside.take(*ticks[551])
    assert beside.n_begun == 4


def test_ticks_that_never_came_pass_for_the_twin_too():
    config = trial_config()
    driven = Driven(config, Differing(), seed=SEED)
    beside = TwinBeside(config)
    ticks = []
    driven.follow(driven.moves(np.random.default_rng([SEED, 3]), 1.5), Heard(lambda *tick: ticks.append(tick)))
    for k, tick in enumerate(ticks):
        if k % 50:
            beside.take(*tick)
    assert beside.n_begun == 1
    assert beside.latched is None
    assert max(map(abs, beside.apart.q_rad)) < 2e-3


def test_a_file_without_a_fit_is_refused_in_words():
    result = CliRunner().invoke(app, ["twin", "shadow", "--session", str(SHIPPED), "--fitted", "ur5e"])
    assert result.exit_code == 2
    assert "expected what `autotelic twin fit` found" in result.output


def test_the_command_tells_of_a_session():
    result = CliRunner().invoke(app, ["twin", "shadow", "--session", str(SHIPPED), "--json"])
    assert result.exit_code == 0, result.output
    told = msgspec.json.decode(result.stdout.splitlines()[-1])
    assert told["latched"] == ""
    assert told["n_compared"] > 100


def test_a_rig_in_one_process_has_no_bus_to_listen_to():
    result = CliRunner().invoke(app, ["twin", "shadow", "--rig", "twin"])
    assert result.exit_code == 2
    assert "expected a bus" in result.output


def test_what_was_fitted_is_what_it_goes_by():
    arm = load_arm("ur5e")
    heavy = msgspec.structs.replace(nominal_plant(arm), payload_kg=1.0)
    config = trial_config()
    config = msgspec.structs.replace(config, arm=msgspec.structs.replace(config.arm, fitted=heavy))
    driven = Driven(trial_config(), Differing(payload_kg=1.0), seed=SEED)
    beside = TwinBeside(config)
    driven.follow(driven.moves(np.random.default_rng([SEED, 3]), SECONDS), Heard(beside.take))
    assert beside.causes == ()
