import msgspec
import numpy as np
import pytest

from config.fitted import RowOff
from config.loader import load_arm
from robot.geometry import quat_of_rotation_vector
from sim_twin.controller.motion.poses import rotation_vector
from sim_twin.fitted import fitted_spec, nominal_plant
from sim_twin.fitting.lengths import FIELDS, PARALLEL, fit_lengths, tool_of
from sim_twin.fitting.stream import Piece

ARM = load_arm("ur5e")


def piece_of(x, q, *, noise_m=0.0, rng=None):
    place, turn = tool_of(ARM, x, q)
    if noise_m:
        place = place + rng.normal(0.0, noise_m, place.shape)
    quat = np.array([quat_of_rotation_vector(*rotation_vector(R)) for R in turn])
    none = np.zeros((len(q), 6))
    return Piece(
        tick_s=0.01, stamp_s=0.0, asked_rad=none, lead_rad=none[:0], q_rad=q, qd_rad_s=none, tcp_m=place, tcp_quat=quat,
        force_n=none[:, :3], opening_m=0.08,
        seen=np.ones(len(q), dtype=bool),
    )  # fmt: skip


def drawn(seed):
    rng = np.random.default_rng(seed)
    q = np.array(ARM.home_rad) + rng.uniform(-0.4, 0.4, (200, 6))
    return rng, rng.uniform(-1e-3, 1e-3, 24), q


def test_rows_are_found_to_a_micrometre_but_along_parallel_axes():
    _, x, q = drawn(1)
    found = fit_lengths(ARM, [piece_of(x, q)])
    others = [k for k in range(24) if k not in PARALLEL and np.isfinite(found.half[k])]
    assert len(others) >= 20
    assert (np.abs(found.x - x)[others] <= found.half[others]).all()
    assert [bool(np.isfinite(found.half[k])) for k in PARALLEL] == [False] * 3
    assert abs(found.sum_d_m - x[list(PARALLEL)].sum()) < found.sum_half_m < 1e-5
    assert found.left_m < 1e-8 < found.before_m


def test_noise_widens_intervals_and_they_hold():
    rng, x, q = drawn(2)
    quiet = fit_lengths(ARM, [piece_of(x, q)])
    found = fit_lengths(ARM, [piece_of(x, q, noise_m=1e-4, rng=rng)])
    told = np.isfinite(found.half)
    assert (found.half[told] >= quiet.half[told]).all()
    assert (np.abs(found.x - x) <= 2.0 * found.half).all()


def test_a_tool_that_never_turns_tells_nothing():
    q = np.tile(np.array(ARM.home_rad), (100, 1))
    assert fit_lengths(ARM, [piece_of(np.zeros(24), q)]) is None
    assert fit_lengths(ARM, [piece_of(np.zeros(24), drawn(3)[2][:10])]) is None


def test_the_twin_has_its_tool_where_the_fitted_rows_have_it():
    import mujoco

    _, x, q = drawn(4)
    rows = tuple(RowOff(**dict(zip(FIELDS, row, strict=True))) for row in x.reshape(6, 4).tolist())
    plant = msgspec.structs.replace(nominal_plant(ARM), rows=rows)
    model = fitted_spec(msgspec.structs.replace(ARM, fitted=plant)).compile()
    data = mujoco.MjData(model)
    data.qpos[:6] = q[0]
    mujoco.mj_kinematics(model, data)
    assert data.site("tcp").xpos == pytest.approx(tool_of(ARM, x, q[:1])[0][0], abs=1e-9)
