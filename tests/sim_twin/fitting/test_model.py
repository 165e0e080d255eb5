import msgspec
import numpy as np
import pytest

from config.loader import load_arm
from sim_twin.fitted import Smoothing, joint_servos, nominal_plant
from sim_twin.fitting.model import ArmAlone, delayed, smoothed
from sim_twin.fitting.stream import pieces_of
from sim_twin.fitting.values import VALUES, plant_of, vector_of
from tests.support.fit_streams import RAISED_RAD, ticks_of_twin, waves

ARM = load_arm("ur5e")
OTHER = msgspec.structs.replace(
    nominal_plant(ARM), lag_s=(0.05, 0.051, 0.052, 0.053, 0.054, 0.055), dead_time_s=0.0053, smoothing_s=0.012,
    friction_nm=(2.0, 3.0, 4.0, 0.5, 0.5, 0.5), payload_kg=0.7,
    stiffness_nm_rad=(5000.0, 6000.0, 7000.0, 1000.0, 1200.0, 900.0),
)  # fmt: skip


@pytest.mark.parametrize("tick_s", [0.002, 0.01])
@pytest.mark.parametrize("fitted", [None, OTHER, msgspec.structs.replace(OTHER, payload_kg=-0.4)])
def test_the_arm_alone_moves_as_the_whole_twin_does(fitted, tick_s):
    arm = msgspec.structs.replace(ARM, fitted=fitted)
    joints = waves(np.add(ARM.home_rad, RAISED_RAD), n=round(1.5 / tick_s), tick_s=tick_s)
    (piece,) = pieces_of(ticks_of_twin(arm, joints, tick_s=tick_s), tick_s=tick_s)
    alone = ArmAlone(ARM, tick_s=tick_s, physics_s=0.002, opening_m=piece.opening_m)

    simulated = alone.joints(vector_of(nominal_plant(arm))[None], piece)[0]

    late = round(0.5 / tick_s)
    assert np.abs(simulated - piece.q_rad)[late:].max() < 2e-6
    assert np.ptp(piece.q_rad, axis=0).min() > 0.1


def test_what_is_changed_of_a_plant_changes_its_joints():
    joints = waves(np.add(ARM.home_rad, RAISED_RAD), n=400, tick_s=0.002)
    (piece,) = pieces_of(ticks_of_twin(ARM, joints, tick_s=0.002), tick_s=0.002)
    alone = ArmAlone(ARM, tick_s=0.002, physics_s=0.002, opening_m=piece.opening_m)
    x = vector_of(nominal_plant(ARM))
    changed = np.tile(x, (len(VALUES) + 1, 1))
    for k, value in enumerate(VALUES):
        changed[k, k] += value.step
    made = alone.joints(changed, piece)
    for k, value in enumerate(VALUES):
        assert np.abs(made[k] - made[-1]).max() > 1e-7, value.name


def test_a_plant_and_its_vector_are_one_thing():
    assert plant_of(vector_of(OTHER), OTHER) == OTHER
    assert len(vector_of(OTHER)) == len(VALUES)


def test_a_smoothed_ramp_trails_by_the_smoothing():
    ramp = np.arange(500)[:, None] * 0.002 * np.ones(6)
    smoothing = Smoothing(0.03, 0.002)
    smoothing.seat(ramp[0])
    stepped = np.array([smoothing.step(row) for row in ramp])
    assert ramp[-1] - stepped[-1] == pytest.approx(np.full(6, 0.03), abs=1e-9)
    assert np.abs(smoothed(ramp, 0.03, 0.002) - stepped).max() < 1e-12


def test_a_delay_between_two_steps_is_between_them():
    asked = np.arange(20.0)[:, None]
    assert delayed(asked, 2.25)[10:, 0] == pytest.approx(asked[10:, 0] - 2.25)
    assert (delayed(asked, 0.0) == asked).all()


def test_nothing_changes_for_an_arm_of_which_nothing_was_fitted():
    law = 0.004 + 0.03 * (1 + 40 / 1200)
    servos = joint_servos(ARM, 0.01)
    assert [servo.friction_nm for servo in servos] == [0.0] * 6
    assert servos[0].damping_nm_s_rad / servos[0].stiffness_nm_rad == pytest.approx(law - 0.004 - 0.005)
