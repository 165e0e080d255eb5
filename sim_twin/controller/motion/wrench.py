"""What the arm's sensors say of forces: contacts of the tool, weight that is not known, torques as currents."""

from typing import TypeAlias

import mujoco
import numpy as np

from sim_twin.controller.motion.poses import Array

__all__ = [
    "GRAVITY_M_S2",
    "NM_PER_A",
    "ContactWrench",
    "ForceSensor",
    "Payload",
    "cross",
    "is_same_payload",
    "payload_bias",
]

NM_PER_A = np.array([13.6, 13.6, 13.6, 9.1, 9.1, 9.1])
"""Joint torque over motor current: a torque constant near 0.135 (0.09) Nm/A behind a gear of 101, as published
identifications of the UR5's large (small) joints have it; recalled, not measured."""
GRAVITY_M_S2 = 9.81
Payload: TypeAlias = tuple[float, Array]
"""Mass (kg) and centre of gravity (m, flange frame)."""
_NEVER = -1


class ContactWrench:
    """Force and torque that the world puts on the tool's bodies, from the solver's contacts.

    Args:
        model: The twin's; the tool is the body ``tool`` and what hangs on it.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        tool = model.body("tool").id
        bodies = {b for b in range(model.nbody) if _hangs_on(model, b, tool)}
        self._is_tool = np.array([model.geom_bodyid[g] in bodies for g in range(model.ngeom)])
        self._force = np.zeros(6)

    def at(self, model: mujoco.MjModel, data: mujoco.MjData, point_m: Array) -> Array:
        """Return force and torque about a point, base axes.  (3,) -> (6,)"""
        total = np.zeros(6)
        if not data.ncon:
            return total
        sides = self._is_tool[data.contact.geom]
        for i in np.flatnonzero(sides[:, 0] != sides[:, 1]).tolist():
            mujoco.mj_contactForce(model, data, i, self._force)
            R = data.contact.frame[i].reshape(3, 3)
            # The solver's force acts on the second geom.
            sign = 1.0 if sides[i, 1] else -1.0
            force = sign * (self._force[:3] @ R)
            total[:3] += force
            total[3:] += sign * (self._force[3:] @ R) + cross(data.contact.pos[i] - point_m, force)
        return total


class ForceSensor:
    """What is read at the tool: contacts, weight that nobody told of, less what was zeroed.

    Args:
        model: The twin's.
        payload: What hangs on the flange, as the controller knows too.
    """

    def __init__(self, model: mujoco.MjModel, payload: Payload) -> None:
        self._contacts = ContactWrench(model)
        self._real = self.told = payload
        self._zero = np.zeros(6)
        self._zeroing = (_NEVER, _NEVER)

    @property
    def is_biased(self) -> bool:
        """The payload is not the one that was told."""
        return not is_same_payload(self.told, self._real)

    def tell(self, payload: Payload, *, zeroing: tuple[int, int]) -> None:
        """Take a payload as known, and the readings in two slices to come as nothing."""
        self.told, self._zeroing = payload, zeroing

    def hang(self, payload: Payload) -> None:
        """Let another payload hang on the flange than was told."""
        self._real = payload

    def zero(self, wrench: Array) -> None:
        """Take what was read as nothing from the next reading on.  (6,)"""
        self._zero = self._zero + wrench

    def read(
        self, model: mujoco.MjModel, data: mujoco.MjData, point_m: Array, T_bf: Array | None, n_slices: int
    ) -> Array:
        """Return force and torque about a point, base axes.  (3,), (4, 4) -> (6,)

        Args:
            model: The twin's.
            data: Likewise.
            point_m: The tool centre point.
            T_bf: The flange, needed where the sensor is biased.
            n_slices: Which slice it is.
        """
        wrench = self._contacts.at(model, data, point_m) - self._zero
        if T_bf is not None:
            wrench += payload_bias(T_bf, point_m, self._real, self.told)
        if n_slices in self._zeroing:
            self.zero(wrench)
            return np.zeros(6)
        return wrench


def is_same_payload(one: Payload, other: Payload) -> bool:
    """Return whether two payloads are one: then a sensor has no bias."""
    return one[0] == other[0] and one[1].tolist() == other[1].tolist()


def payload_bias(T_bf: Array, point_m: Array, real: Payload, known: Payload) -> Array:
    """Return what a sensor reads too much because the payload is not the one it was told.

    Args:
        T_bf: The flange.
        point_m: Where torques are taken about.
        real: Mass (kg) and centre of gravity (flange frame) of what hangs on the flange.
        known: The same, as the controller was told.

    Returns:
        Force and torque, base axes.  (6,)
    """
    R, from_point_m = T_bf[:3, :3], T_bf[:3, 3] - point_m
    down_n = about_x_nm = about_y_nm = 0.0
    for sign, (mass, cog) in ((1.0, real), (-1.0, known)):
        weight_n = -sign * mass * GRAVITY_M_S2
        x, y, _ = (R @ cog + from_point_m).tolist()
        down_n += weight_n
        about_x_nm += y * weight_n
        about_y_nm -= x * weight_n
    return np.array([0.0, 0.0, down_n, about_x_nm, about_y_nm, 0.0])


def cross(a: Array, b: Array) -> Array:
    """Return a x b.  (3,), (3,) -> (3,)

    NumPy's own takes a hundred microseconds of a slice's two thousand.
    """
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _hangs_on(model: mujoco.MjModel, body: int, root: int) -> bool:
    while body:
        if body == root:
            return True
        body = int(model.body_parentid[body])
    return False
