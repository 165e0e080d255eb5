"""Where the tool is for given joints and which joints bring it somewhere, for UR's family of arms.

Forward and Jacobian take any Denavit-Hartenberg table of six rows. The inverse is the closed form of the nominal table
(three parallel axes, Hawkins 2013, "Analytic Inverse Kinematics for the Universal Robots UR-5/UR-10 Arms"), refined by
Newton's method on the true table, so that an arm with calibrated rows is solved as well.
"""

import math
from collections.abc import Sequence

import msgspec
import numpy as np

from config.arm import ArmConfig
from robot.compiled import Table
from sim_twin.controller.motion.chain import chain_and_jacobian, chain_end
from sim_twin.controller.motion.poses import Array, between, inverse, matrix_from_pose, pose_from_matrix, six, vec6
from sim_twin.controller.motion.sensed import tool_motion

__all__ = [
    "ArmKinematics",
    "DhRow",
    "KinematicsError",
    "NoSolutionError",
    "SingularError",
    "calibrated",
    "dh_rows",
    "joint_speeds_of",
]

Rows = tuple["DhRow", ...]
TURN = 2.0 * math.pi
RANGE_RAD = TURN + 1e-9
TOLERANCE = 1e-6
"""Newton stops after a step that moved no joint by more than this: its error is about the square."""
MAX_NEWTON = 12
MAX_STEP_RAD = 0.4
"""A Newton step longer than this has left the neighbourhood of its seed."""
SINGULAR_DET = 1e-5
"""Smallest |det J| of a pose that can be left in every direction; the UR5e's greatest is about 0.07."""
SINGULAR_SINE = 1e-7
FLANGE = np.eye(4)
"""The tool of an arm without one."""


class KinematicsError(ValueError):
    """No joint angles answer the question."""


class NoSolutionError(KinematicsError):
    """The pose is out of reach."""


class SingularError(KinematicsError):
    """The arm cannot move in every direction from here."""


class DhRow(msgspec.Struct, frozen=True, kw_only=True):
    """One row of the table: Rz(q + theta) Tz(d) Tx(a) Rx(alpha)."""

    a_m: float
    d_m: float
    alpha_rad: float
    theta_rad: float = 0.0


def dh_rows(arm: ArmConfig) -> Rows:
    """Return the arm file's nominal table."""
    return tuple(DhRow(a_m=j.a_m, d_m=j.d_m, alpha_rad=j.alpha_rad) for j in arm.joints)


def calibrated(rows: Rows, deltas: Rows) -> Rows:
    """Return a table with an arm's own calibration added, row by row."""
    return tuple(
        DhRow(
            a_m=r.a_m + e.a_m,
            d_m=r.d_m + e.d_m,
            alpha_rad=r.alpha_rad + e.alpha_rad,
            theta_rad=r.theta_rad + e.theta_rad,
        )
        for r, e in zip(rows, deltas, strict=True)
    )


class ArmKinematics:
    """Kinematics of one arm's table. Holds constants only; the tool centre point comes with every question.

    Args:
        nominal: The table that the closed form stands on.
        true: The arm's own table; the nominal one where absent.
    """

    def __init__(self, nominal: Rows, *, true: Rows | None = None) -> None:
        self._nominal = nominal
        self.recalibrate(nominal if true is None else true)

    @property
    def nominal(self) -> Rows:
        """The table that the closed form stands on."""
        return self._nominal

    def recalibrate(self, true: Rows) -> None:
        """Take another table for the arm's own from now on."""
        self.rows = true
        self._is_nominal = self.rows == self._nominal
        self._table = np.array(
            [(r.theta_rad, r.a_m, r.d_m, math.cos(r.alpha_rad), math.sin(r.alpha_rad)) for r in self.rows]
        )

    def forward(self, q_rad: Sequence[float] | Array, T_ft: Array | None = None) -> Array:
        """Return T_bt for joint angles; of the flange where no tool is given.  (6,), (4, 4) -> (4, 4)"""
        T_bf = chain_end(six(q_rad), self._table)
        return T_bf if T_ft is None else T_bf @ T_ft

    def pose(self, q_rad: Sequence[float] | Array, tcp: Sequence[float] | Array | None = None) -> Array:
        """Return the UR pose of the tool for joint angles and a tool offset.  (6,), (6,) -> (6,)"""
        return pose_from_matrix(self.forward(q_rad, None if tcp is None else matrix_from_pose(tcp)))

    def forward_and_jacobian(self, q_rad: Sequence[float] | Array, T_ft: Array | None = None) -> tuple[Array, Array]:
        """Return T_bt and J with (v, w) = J qd at the tool, base axes.  (6,), (4, 4) -> (4, 4), (6, 6)"""
        T = FLANGE if T_ft is None else np.ascontiguousarray(T_ft, dtype=np.float64)
        return chain_and_jacobian(six(q_rad), self._table, T)

    def jacobian(self, q_rad: Sequence[float] | Array, T_ft: Array | None = None) -> Array:
        """Return J with (v, w) = J qd at the tool, base axes.  (6,), (4, 4) -> (6, 6)"""
        return self.forward_and_jacobian(q_rad, T_ft)[1]

    def tool_motion(self, q_rad: Array, qd_rad_s: Array, T_ft: Array, before: Table) -> Table:
        """Return pose, twist, and the flange's acceleration and velocity: see there.  (6,), (6,), (4, 4), (3, 6)"""
        return tool_motion(six(q_rad), six(qd_rad_s), self._table, np.ascontiguousarray(T_ft, dtype=np.float64), before)

    def tool_speed(self, q_rad: Array, qd_rad_s: Array, T_ft: Array | None = None) -> float:
        """Return how fast the tool moves, m/s.  (6,), (6,), (4, 4) -> ()"""
        return float(np.linalg.norm(self.jacobian(q_rad, T_ft)[:3] @ qd_rad_s))

    def joint_speeds(self, q_rad: Array, twist: Array, T_ft: Array | None = None) -> Array:
        """Return the joint speeds of a tool speed (v, w) in base axes.  (6,), (6,) -> (6,)

        Raises:
            SingularError: the arm is where some directions are closed to it.
        """
        return joint_speeds_of(self.jacobian(q_rad, T_ft), twist)

    def refine(self, T_bt: Array, q_near: Array, T_ft: Array | None = None) -> Array:
        """Return the joints of a pose by Newton's method from a neighbour.  (4, 4), (6,) -> (6,)

        Raises:
            SingularError: on the way there is a pose that some directions are closed to.
            NoSolutionError: it does not converge; the seed is no neighbour.
        """
        q = q_near
        for _ in range(MAX_NEWTON):
            T_now, J = self.forward_and_jacobian(q, T_ft)
            step = joint_speeds_of(J, np.concatenate(between(T_now, T_bt)))
            largest = float(np.abs(step).max())
            if largest > MAX_STEP_RAD:
                raise NoSolutionError(
                    f"inverse kinematics: the pose is {largest:.2g} rad off its seed; take smaller steps"
                )
            q = q + step
            if largest < TOLERANCE:
                return q
        raise NoSolutionError(f"inverse kinematics: no convergence in {MAX_NEWTON} steps; is the pose within reach?")

    def solutions(self, T_bt: Array, T_ft: Array | None = None, *, q6_free_rad: float = 0.0) -> list[Array]:
        """Return all joint angles (up to eight) within half a turn that bring the tool to a pose.

        Args:
            T_bt: Pose of the tool.
            T_ft: The tool; the flange where absent.
            q6_free_rad: Wrist 3 where wrist 2 is straight and leaves it free.
        """
        T_bf = T_bt if T_ft is None else T_bt @ inverse(T_ft)
        found = _closed_form(self._nominal, T_bf, q6_free_rad)
        if self._is_nominal:
            return found
        return [q for q in (self._refined(T_bf, seed) for seed in found) if q is not None]

    def inverse(
        self, pose: Sequence[float] | Array, q_near: Sequence[float] | Array, tcp: Sequence[float] | Array | None = None
    ) -> Array:
        """Return the joint angles nearest to others that bring the tool to a UR pose.  (6,), (6,), (6,) -> (6,)

        Raises:
            NoSolutionError: the pose is out of reach.
        """
        near = vec6(q_near)
        T_ft = None if tcp is None else matrix_from_pose(tcp)
        T_bt = matrix_from_pose(vec6(pose, "pose"))
        found = [_nearest_turn(q, near) for q in self.solutions(T_bt, T_ft, q6_free_rad=float(near[5]))]
        if not self._is_nominal:
            # Near its own reach, a calibrated arm goes where the nominal one does not.
            by_neighbour = self._refined(T_bt if T_ft is None else T_bt @ inverse(T_ft), near)
            found += [] if by_neighbour is None else [by_neighbour]
        if not found:
            raise NoSolutionError(f"inverse kinematics: no joint angles bring the tool to {np.round(pose, 4).tolist()}")
        best = min(found, key=lambda q: float(np.square(q - near).sum()))
        polished = self._refined(T_bt if T_ft is None else T_bt @ inverse(T_ft), best)
        return best if polished is None else polished

    def has_solution(
        self, pose: Sequence[float] | Array, q_near: Sequence[float] | Array, tcp: Sequence[float] | Array | None = None
    ) -> bool:
        """Return whether `inverse` has an answer (URScript's get_inverse_kin_has_solution)."""
        try:
            self.inverse(pose, q_near, tcp)
        except KinematicsError:
            return False
        return True

    def _refined(self, T_bf: Array, seed: Array) -> Array | None:
        """The closed form loses digits near a singularity: what Newton cannot better there stays as it is."""
        try:
            return self.refine(T_bf, seed)
        except KinematicsError:
            return None


def joint_speeds_of(J: Array, twist: Array) -> Array:
    """Return qd with J qd = (v, w).  (6, 6), (6,) -> (6,)

    Raises:
        SingularError: J has no inverse worth the name.
    """
    det = float(np.linalg.det(J))
    if not abs(det) > SINGULAR_DET:
        raise SingularError(
            f"singular pose: |det J| is {abs(det):.1e}, expected above {SINGULAR_DET:.0e}; go round it or use movej"
        )
    return np.linalg.solve(J, twist)


def _nearest_turn(q: Array, near: Array) -> Array:
    """Return q moved by whole turns to lie nearest to others, within one turn to either side."""
    moved = q + TURN * np.round((near - q) / TURN)
    moved = np.where(moved > RANGE_RAD, moved - TURN, moved)
    return np.where(moved < -RANGE_RAD, moved + TURN, moved)


def _closed_form(rows: Rows, T_bf: Array, q6_free: float) -> list[Array]:
    """Return every solution of the nominal table.  (4, 4) -> [(6,)]"""
    d4, d6 = rows[3].d_m, rows[5].d_m
    found: list[Array] = []
    for q1 in _bases(T_bf, d4, d6):
        s1, c1 = math.sin(q1), math.cos(q1)
        cosine = (T_bf[0, 3] * s1 - T_bf[1, 3] * c1 - d4) / d6
        if abs(cosine) > 1.0 + 1e-9:
            continue
        q5 = math.acos(max(-1.0, min(1.0, cosine)))
        for wrist in (q5, -q5) if math.sin(q5) > SINGULAR_SINE else (q5,):
            q6 = _wrist_3(T_bf, s1, c1, wrist, q6_free)
            found.extend(_planar(rows, T_bf, q1, wrist, q6))
    return found


def _bases(T_bf: Array, d4: float, d6: float) -> tuple[float, ...]:
    """Return base angles that put the wrist's centre d4 beside the arm's plane."""
    x, y = T_bf[0, 3] - d6 * T_bf[0, 2], T_bf[1, 3] - d6 * T_bf[1, 2]
    reach = math.hypot(x, y)
    if reach < abs(d4):
        return ()
    towards, aside = math.atan2(y, x), math.acos(d4 / reach)
    return towards + aside + math.pi / 2.0, towards - aside + math.pi / 2.0


def _wrist_3(T_bf: Array, s1: float, c1: float, q5: float, free: float) -> float:
    s5 = math.sin(q5)
    if abs(s5) <= SINGULAR_SINE:
        return free
    return math.atan2((T_bf[1, 1] * c1 - T_bf[0, 1] * s1) / s5, (T_bf[0, 0] * s1 - T_bf[1, 0] * c1) / s5)


def _row(row: DhRow, q: float) -> Array:
    s, c, ca, sa = math.sin(q), math.cos(q), math.cos(row.alpha_rad), math.sin(row.alpha_rad)
    return np.array(
        [
            [c, -s * ca, s * sa, row.a_m * c],
            [s, c * ca, -c * sa, row.a_m * s],
            [0.0, sa, ca, row.d_m],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _planar(rows: Rows, T_bf: Array, q1: float, q5: float, q6: float) -> list[Array]:
    """Return both elbows of shoulder, elbow and wrist 1, which turn about parallel axes."""
    a2, a3, d4 = rows[1].a_m, rows[2].a_m, rows[3].d_m
    T_14 = inverse(_row(rows[0], q1)) @ T_bf @ inverse(_row(rows[4], q5) @ _row(rows[5], q6))
    x, y = T_14[0, 3] - d4 * T_14[0, 1], T_14[1, 3] - d4 * T_14[1, 1]
    cosine = (x * x + y * y - a2 * a2 - a3 * a3) / (2.0 * a2 * a3)
    if abs(cosine) > 1.0 + 1e-9:
        return []
    bend = math.acos(max(-1.0, min(1.0, cosine)))
    # Wrist 1 turns frame 4's x axis by q2 + q3 + q4 in the arm's plane.
    total = math.atan2(T_14[1, 0], T_14[0, 0])
    found = []
    for q3 in (bend, -bend):
        q2 = math.atan2(y, x) - math.atan2(a3 * math.sin(q3), a2 + a3 * math.cos(q3))
        found.append(np.array([_wrapped(q) for q in (q1, q2, q3, total - q2 - q3, q5, q6)]))
    return found


def _wrapped(q: float) -> float:
    return math.remainder(q, TURN)
