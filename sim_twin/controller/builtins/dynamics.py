"""Jacobian, mass matrix, Coriolis torques. Masses are MuJoCo's: the twin's own, the gripper's with them."""

import mujoco
import numpy as np

from sim_twin.controller.builtins.moving import as_list
from sim_twin.controller.machine import Machine
from sim_twin.controller.motion.poses import Array, matrix_from_pose
from sim_twin.controller.script import Builtins, Value
from sim_twin.controller.script.builtins import flag, pose, vector

__all__ = ["dynamics_builtins"]

_STEP_S = 1e-5


def dynamics_builtins(machine: Machine) -> Builtins:
    """Return the questions about the arm's dynamics; without joints they are those of now."""
    drive, kinematics = machine.drive, machine.drive.kinematics
    dynamics = _Dynamics(machine)

    def joints(q: Value) -> Array:
        return drive.measured.q_rad if q is None else np.array(vector(q, 6))

    def speeds(qd: Value) -> Array:
        return drive.measured.qd_rad_s if qd is None else np.array(vector(qd, 6))

    def tool(tcp: Value) -> Array:
        return drive.core.T_ft if tcp is None else matrix_from_pose(pose(tcp))

    def get_jacobian(q: Value = None, tcp: Value = None) -> Value:
        return as_list(kinematics.jacobian(joints(q), tool(tcp)))

    def get_jacobian_time_derivative(q: Value = None, qd: Value = None, tcp: Value = None) -> Value:
        here, way, T_ft = joints(q), speeds(qd) * _STEP_S, tool(tcp)
        change = kinematics.jacobian(here + way, T_ft) - kinematics.jacobian(here - way, T_ft)
        return as_list(change / (2.0 * _STEP_S))

    def get_mass_matrix(q: Value = None, include_rotors_inertia: Value = False) -> Value:
        rotors = np.diag(machine.world.model.dof_armature[:6])
        mass = dynamics.mass_matrix(joints(q))
        return as_list(mass if flag(include_rotors_inertia) else mass - rotors)

    def get_coriolis_and_centrifugal_torques(q: Value = None, qd: Value = None) -> Value:
        return as_list(dynamics.coriolis_nm(joints(q), speeds(qd)))

    return {
        "get_coriolis_and_centrifugal_torques": get_coriolis_and_centrifugal_torques,
        "get_jacobian": get_jacobian,
        "get_jacobian_time_derivative": get_jacobian_time_derivative,
        "get_mass_matrix": get_mass_matrix,
    }


class _Dynamics:
    """Works on a copy of the physics' state, so that a question never stirs the world."""

    def __init__(self, machine: Machine) -> None:
        self._world = machine.world
        self._data = mujoco.MjData(machine.world.model)

    def mass_matrix(self, q_rad: Array) -> Array:
        """Return M of the six joints.  (6,) -> (6, 6)"""
        model, data = self._world.model, self._posed(q_rad)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        return mass[:6, :6]

    def coriolis_nm(self, q_rad: Array, qd_rad_s: Array) -> Array:
        """Return C(q, qd) qd.  (6,), (6,) -> (6,)"""
        model, data = self._world.model, self._posed(q_rad)
        found = []
        for speed in (np.zeros(6), qd_rad_s):
            data.qvel[:6] = speed
            mujoco.mj_comVel(model, data)
            torque = np.zeros(model.nv)
            mujoco.mj_rne(model, data, 0, torque)
            found.append(torque[:6])
        return found[1] - found[0]

    def _posed(self, q_rad: Array) -> mujoco.MjData:
        model, data = self._world.model, self._data
        data.qpos[:] = self._world.data.qpos
        data.qpos[:6] = q_rad
        data.qvel[:] = 0.0
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_crb(model, data)
        return data
