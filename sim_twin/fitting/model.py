"""The twin's arm alone, driven with recorded commands: what a set of values makes of its joints.

The same description, servos, integrator and step as the twin's; table, things and fingers are left out. A test holds
the two to one another.
"""

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray
from scipy.signal import lfilter

from config.arm import ArmConfig
from robot.description import arm_spec
from sim_twin.fitted import HARD_FRICTION, LEAST_LAG_S, SOLVED, add_servos
from sim_twin.fitting.stream import Piece
from sim_twin.fitting.values import N_VALUES

__all__ = ["ArmAlone", "delayed", "smoothed"]

Array = NDArray[np.float64]
_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS


class ArmAlone:
    """Makes joints of commands.

    Args:
        arm: its file; what was fitted of it before is not looked at.
        tick_s: how long a command acts.
        physics_s: a step of the physics.
        opening_m: of the hand.
    """

    def __init__(self, arm: ArmConfig, *, tick_s: float, physics_s: float, opening_m: float) -> None:
        self.tick_s, self.physics_s = tick_s, physics_s
        self.n_steps = max(1, round(tick_s / physics_s))
        self._base = _compiled(arm, tick_s=tick_s, physics_s=physics_s, opening_m=opening_m)
        self._data = mujoco.MjData(self._base)
        self._models: list[mujoco.MjModel] = []
        self._tool = tool = self._base.body("tool").id
        self._mass, self._inertia = float(self._base.body_mass[tool]), self._base.body_inertia[tool].copy()
        self._n_state = mujoco.mj_stateSize(self._base, _STATE)

    def joints(self, x: Array, piece: Piece) -> Array:
        """Return what joints each set of values makes of a piece's commands, at its ticks.

        Args:
            x: (k, N_VALUES)
            piece: (n, 6) commands.

        Returns:
            (k, n, 6)
        """
        assert x.shape[1] == N_VALUES
        while len(self._models) < len(x):
            self._models.append(_copy(self._base))
        for model, values in zip(self._models, x, strict=False):
            self._put(model, values)
        control = np.stack([self._control(values, piece) for values in x])
        state, _ = rollout.rollout(
            self._models[: len(x)], self._data, np.tile(self._start(piece), (len(x), 1)), control
        )  # fmt: skip
        ends = state[:, self.n_steps - 1 :: self.n_steps, 1:7]
        first = np.broadcast_to(piece.start()[0], (len(x), 1, 6))
        return np.concatenate([first, ends[:, : piece.n - 1]], axis=1)

    def _put(self, model: mujoco.MjModel, x: Array) -> None:
        lag, stiffness = x[:6], x[6:12]
        payload, dead_time, smoothing = x[18:21].tolist()
        servo = np.maximum(LEAST_LAG_S, lag - (dead_time + smoothing + self.tick_s / 2.0))
        model.actuator_gainprm[:6, 0] = stiffness
        model.actuator_biasprm[:6, 1] = -stiffness
        model.actuator_biasprm[:6, 2] = -stiffness * servo
        model.dof_frictionloss[:6] = x[12:18]
        share = max(0.0, payload) / self._mass + 1.0
        tool = self._tool
        model.body_mass[tool] = self._mass * share
        model.body_inertia[tool] = self._inertia * share
        model.body_gravcomp[tool] = 1.0 / share if payload > 0.0 else 1.0 - payload / self._mass
        mujoco.mj_setConst(model, self._data)

    def _control(self, x: Array, piece: Piece) -> Array:
        asked = np.repeat(np.concatenate([piece.lead_rad, piece.asked_rad]), self.n_steps, axis=0)
        _, dead_time, smoothing = x[18:21].tolist()
        put = delayed(smoothed(asked, smoothing, self.physics_s), dead_time / self.physics_s)
        return put[len(piece.lead_rad) * self.n_steps :]

    def _start(self, piece: Piece) -> Array:
        state = np.zeros(self._n_state)
        state[1:7], state[7:13] = piece.start()
        return state


def smoothed(asked: Array, time_s: float, dt_s: float) -> Array:
    """Return set-points after two equal first-order stages in implicit steps; see sim_twin.fitted.  (n, k) -> (n, k)"""
    if time_s <= 0.0:
        return asked
    share = dt_s / (dt_s + time_s / 2.0)
    for _ in range(2):
        asked, _ = lfilter([share], [1.0, share - 1.0], asked, axis=0, zi=(1.0 - share) * asked[:1])
    return asked


def delayed(asked: Array, n_steps: float) -> Array:
    """Return set-points so many steps later, between two of them in proportion.  (n, k) -> (n, k)"""
    whole = int(np.floor(n_steps))
    part = n_steps - whole
    later = _later(asked, whole)
    return later if part == 0.0 else (1.0 - part) * later + part * _later(asked, whole + 1)


def _later(asked: Array, n: int) -> Array:
    return asked if n == 0 else np.concatenate([np.repeat(asked[:1], n, axis=0), asked[:-n]])[: len(asked)]


def _copy(model: mujoco.MjModel) -> mujoco.MjModel:
    return model.__copy__()


def _compiled(arm: ArmConfig, *, tick_s: float, physics_s: float, opening_m: float) -> mujoco.MjModel:
    spec = arm_spec(arm)
    for joint in [j for j in spec.joints if j.name.startswith("finger_")]:
        finger = joint.parent
        finger.pos = np.array(finger.pos) + opening_m / 2.0 * np.array(joint.axis)
        spec.delete(joint)
    for geom in list(spec.geoms):
        geom.contype = geom.conaffinity = 0
    spec.option.timestep = physics_s
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.option.tolerance, spec.option.iterations = SOLVED
    for joint in spec.joints:
        joint.solimp_friction[:2] = HARD_FRICTION
    add_servos(spec, arm, physics_s=physics_s, tick_s=tick_s)
    for actuator in spec.actuators:  # what is late is made of the commands here
        actuator.nsample, actuator.delay = 0, 0.0
    return spec.compile()
