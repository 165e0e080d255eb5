"""What all motions share: the set-point, who drives it in a slice, what goes on when nobody does, and taking over.

A motion is a Python generator; each `yield` is one slice of 2 ms, and in each slice it puts the set-point once. The
caller resumes the program's motions and then ends the slice. A motion that returns while the arm still moves (a blend,
a servo, a speed) leaves a tail that goes on until the next motion takes over, in the very slice that follows.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np

from sim_twin.controller.motion.force import ForceLaw, ForceTask
from sim_twin.controller.motion.kinematics import ArmKinematics, joint_speeds_of
from sim_twin.controller.motion.paths import Path
from sim_twin.controller.motion.poses import Array, matrix_from_pose, pose_from_matrix, vec6
from sim_twin.controller.motion.profiles import Residual, Trapezoid, way_back
from sim_twin.controller.motion.servo import limited
from sim_twin.controller.motion.setpoint import SLICE_S, Pace, SetPoint
from sim_twin.controller.motion.stopping import stop_time_s
from sim_twin.controller.motion.tails import Motion, MotionConflictError, Sensed, Tail

__all__ = ["Motion", "MotionConflictError", "MotionCore", "Sensed", "Tail"]

REST_RAD_S2 = 10.0
"""Deceleration of a motion that its program abandoned."""
STILL_RAD_S = 1e-6
LEAST_RATE = 1e-3
LEAST_PACE = 0.02
"""Below this pace what is taken over runs out by the clock."""
MOST_OFFSET = 10.0
"""A tool's offset beyond it (m, rad) is a slip, and great ones would overflow."""
FREEDRIVE_SHARE = 0.9
"""How much of the servo's damping freedrive takes away; at 1 a push would never come to rest."""
TIME_EPSILON_S = 1e-9


class MotionCore:
    """The state that motions share.

    Args:
        kinematics: The arm's.
        setpoint: Where it is asked to be.
        speed_rad_s: Greatest speed of each joint.
        acceleration_rad_s2: Greatest acceleration of each joint that a move or speedj uses.
        servo_lag_s: How far the servo behind the set-point trails a ramp.
        dead_time_s: The dead time in the lag's law.
    """

    def __init__(
        self,
        *,
        kinematics: ArmKinematics,
        setpoint: SetPoint,
        speed_rad_s: Array,
        acceleration_rad_s2: Array,
        servo_lag_s: float,
        dead_time_s: float,
    ) -> None:
        self.kinematics, self.setpoint = kinematics, setpoint
        self.speed_rad_s, self.acceleration_rad_s2 = speed_rad_s, acceleration_rad_s2
        self.servo_lag_s, self.dead_time_s = servo_lag_s, dead_time_s
        self.pace = Pace()
        self.T_ft = np.eye(4)
        self.tail: Tail | None = None
        self._stop_tail: Tail | None = None
        self.nominal_rad = setpoint.q_target
        self._nominal_before = setpoint.q_target
        self._shift = np.zeros(6)
        self._is_driven = self._was_driven = False
        self._gear: float | None = None
        self._pace_driven = 1.0
        self._n_stops = 0
        self._law: ForceLaw | None = None
        self._free_axes: Array | None = None

    # ------------------------------------------------------------------------------------------------ tool and poses

    def set_tcp(self, offset: Sequence[float] | Array) -> None:
        """Set the tool's pose in the flange frame, a UR pose; running moves keep theirs.

        Raises:
            ValueError: it is further from the flange than any tool.
        """
        pose = vec6(offset, "tool offset")
        if not (np.abs(pose) <= MOST_OFFSET).all():
            raise ValueError(f"tool offset: expected within {MOST_OFFSET:g} m and rad, got {pose.tolist()}")
        self.T_ft = matrix_from_pose(pose)

    @property
    def tcp_offset(self) -> Array:
        """The tool's pose in the flange frame.  () -> (6,)"""
        return pose_from_matrix(self.T_ft)

    def tool_at(self, q_rad: Array) -> Array:
        """Return T_bt for joint angles.  (6,) -> (4, 4)"""
        return self.kinematics.forward(q_rad, self.T_ft)

    def joints_of(self, pose: Sequence[float] | Array) -> Array:
        """Return the joints of a UR pose nearest to the set-point.  (6,) -> (6,)

        Raises:
            NoSolutionError: it is out of reach.
        """
        return self.kinematics.inverse(vec6(pose, "pose"), self.setpoint.q_target, self.tcp_offset)

    def target_tool(self) -> tuple[Array, Array]:
        """Return the UR pose and the speed (v, w) of the tool that the set-point asks for.  () -> (6,), (6,)"""
        T_bt, J = self.kinematics.forward_and_jacobian(self.setpoint.q_target, self.T_ft)
        return pose_from_matrix(T_bt), J @ self.setpoint.qd_target

    # --------------------------------------------------------------------------------------------------- one slice

    def claim(self) -> None:
        """Take this slice for one motion.

        Raises:
            MotionConflictError: somebody did already.
        """
        if self._is_driven:
            raise MotionConflictError(
                "expected one motion at a time, got a second in the same slice; kill the other thread"
            )
        self._is_driven = True

    def release(self) -> None:
        """Give this slice back: who claimed it moves nothing."""
        self._is_driven = False

    def put(self, q_rad: Array, *, gear: float | None = None) -> None:
        """Drive the set-point in this slice.  (6,)

        Args:
            q_rad: Where to.
            gear: How much faster its time passes than the pace; None if it goes by the clock (see `begin`).

        Raises:
            MotionConflictError: somebody did already.
        """
        self.claim()
        self._gear = gear
        self._nominal_before, self.nominal_rad = self.nominal_rad, q_rad

    def end_slice(self, sensed: Sensed) -> None:
        """End the slice: go on with the tail or come to rest where nobody drove, and comply where force mode is on.

        Raises:
            SingularError: force mode or a tail leads through a singular pose.
        """
        self._was_driven = self._is_driven
        if not self._is_driven:
            self._idle(sensed)
        self._is_driven = False
        if self._law is not None:
            self._shift = self._complied(self._law, sensed) - self.nominal_rad
        self.setpoint.move(self.nominal_rad + self._shift)
        self._pace_driven = self.pace.scale
        self.pace.step()

    @property
    def nominal_speed_rad_s(self) -> Array:
        """What the program's own motion did in the last slice, force mode aside.  () -> (6,)"""
        return (self.nominal_rad - self._nominal_before) / SLICE_S

    @property
    def is_at_rest(self) -> bool:
        """Nothing drives, nothing goes on and the set-point stands."""
        is_idle = self.tail is None and not self._was_driven and not self._is_driven
        return is_idle and self.setpoint.fastest_rad_s < STILL_RAD_S

    def _idle(self, sensed: Sensed) -> None:
        if self._free_axes is not None:
            self.put(self._followed(sensed, self._free_axes))
        elif self.tail is not None:
            try:
                next(self.tail.motion)
            except StopIteration:
                self.tail = None
        if not self._is_driven:
            self.put(self._resting())
        self._was_driven = self.tail is not None

    def _resting(self) -> Array:
        speed = self.nominal_speed_rad_s
        fastest = float(np.abs(speed).max())
        if fastest <= REST_RAD_S2 * SLICE_S:
            return self.nominal_rad
        return self.nominal_rad + speed * (1.0 - REST_RAD_S2 * SLICE_S / fastest) * SLICE_S

    def _complied(self, law: ForceLaw, sensed: Sensed) -> Array:
        q = self.setpoint.q_target
        T_bt, J = self.kinematics.forward_and_jacobian(q, self.T_ft)
        nominal = J @ self.nominal_speed_rad_s
        twist = law.twist(nominal, sensed.wrench, T_bt[:3, 3], is_ending=self.pace.is_paused)
        return q + joint_speeds_of(J, twist) * SLICE_S

    def _followed(self, sensed: Sensed, free: Array) -> Array:
        """Freedrive: the set-point runs ahead of the joints by what the servo would hold them back."""
        ahead = sensed.q_rad + FREEDRIVE_SHARE * self.servo_lag_s * sensed.qd_rad_s
        q = self.setpoint.q_target
        if not free.all():
            J = self.kinematics.jacobian(q, self.T_ft)
            ahead = q + joint_speeds_of(J, free * (J @ (ahead - q)))
        return limited(q, ahead, self.speed_rad_s * SLICE_S)

    # ------------------------------------------------------------------------------------------------- taking over

    def begin_free(self) -> Array:
        """Take over for a motion without a path, and return the speed that it begins with.  () -> (6,)"""
        self.tail = None
        self._seat()
        return self.setpoint.qd_target

    def begin(self, ramp_s: Callable[[Array], float]) -> tuple[Array, Residual | None]:
        """Take over for a path, and return where it begins and what is left of the motion before.

        What is left of a path runs out in the time of paths, at the speed that it has at full pace. Speeds, servos and
        stops know no such time: theirs runs out by the clock, and slower only while the pace falls from what it is.

        Args:
            ramp_s: How long stopping takes from a joint speed, where the motion before does not say where it rests.
        """
        tail, self.tail = self.tail, None
        # What complies is not handed on: force mode goes on complying by itself.
        complying = self._law is not None
        speed = self.nominal_speed_rad_s if complying else self.setpoint.qd_target
        gear, rate = self._taken_at()
        self._seat()
        q = self.setpoint.q_target
        fastest = float(np.abs(speed).max())
        if fastest < STILL_RAD_S:
            return q, None
        speed = speed / rate
        if tail is not None and tail.anchor_rad is not None:
            offset = q - tail.anchor_rad
            duration = -2.0 * float(offset @ speed) / float(speed @ speed)
            if duration > SLICE_S:
                return tail.anchor_rad, Residual(offset, speed, duration, gear)
        duration = ramp_s(speed)
        if self.pace.is_paused and gear == math.inf:
            duration = min(duration, fastest / REST_RAD_S2)
        duration = max(duration, SLICE_S)
        return q + speed * duration / 2.0, Residual(-speed * duration / 2.0, speed, duration, gear)

    def _taken_at(self) -> tuple[float, float]:
        """Return the gear for what is left of the motion before, and the rate that its speed was made at."""
        scale, gear = self.pace.scale, self._gear
        if gear is not None and min(1.0, gear * self._pace_driven) > LEAST_RATE:
            return gear, min(1.0, gear * self._pace_driven)
        return (1.0 / scale if scale > LEAST_PACE else math.inf), 1.0

    def follow(self, path: Path, profile: Trapezoid, residual: Residual | None) -> Motion:
        """Follow a path to its end while the residual of the motion before runs out.

        Resumed after a stop that left the path, it comes back to where it was and goes on.
        """
        t, run_s, n_stops = 0.0, 0.0, self._n_stops
        q = path.at(0.0)
        while True:
            t, q = self._next(path, profile, t, q)
            if n_stops != self._n_stops:
                n_stops, run_s = self._n_stops, 0.0
                residual = way_back(self.begin_free_at() - q)
            elif residual is not None:
                run_s += SLICE_S * residual.rate(self.pace.scale)
            left = residual.at(run_s) if residual else None
            if residual is None or left is None:
                self.put(q, gear=1.0)
            else:
                self.put(q + left[0], gear=residual.gear)
            yield
            if t >= profile.duration_s - TIME_EPSILON_S and left is None:
                return

    def _next(self, path: Path, profile: Trapezoid, t: float, q: Array) -> tuple[float, Array]:
        """Return time and joints of a path's next slice: less of it where a joint would pass its speed."""
        step = SLICE_S * self.pace.scale
        ahead = path.at(profile.at(t + step)[0])
        share = float((np.abs(ahead - q) / self.speed_rad_s).max()) / SLICE_S
        if share <= 1.0 + TIME_EPSILON_S:
            return t + step, ahead
        return t + step / share, path.at(profile.at(t + step / share)[0])

    def begin_stop(self) -> None:
        """Leave everything and stop as fast as the arm may: every joint in proportion, so that it stays on its line."""
        speed = self.begin_free()
        self._n_stops += 1
        self._law, self._free_axes = None, None
        self._gear = None
        self.tail = self._stop_tail = Tail(self._stopping(speed))

    @property
    def is_stopping(self) -> bool:
        """A stop is on its way: it is never refused."""
        return self.tail is not None and self.tail is self._stop_tail

    @property
    def n_stops(self) -> int:
        """How often the arm was stopped off its path: what remembers a set-point from before has to look again."""
        return self._n_stops

    def begin_free_at(self) -> Array:
        """Take over for a motion that remembers where it was, and return where the set-point is.  () -> (6,)"""
        self.begin_free()
        return self.setpoint.q_target

    def refuse(self, sensed: Sensed, *, is_moved: bool = True) -> None:
        """Take the slice's set-point back, where it was moved already, and stop from the one before."""
        if is_moved:
            self.setpoint.undo()
        self._is_driven = False
        self.begin_stop()
        self.end_slice(sensed)

    def hold(self, q_rad: Array) -> None:
        """Put the set-point on the joints as they are, at rest; everything before is forgotten.  (6,)"""
        self.tail, self._law, self._free_axes = None, None, None
        self._n_stops += 1
        self.setpoint.place(q_rad)
        self._is_driven = self._was_driven = False
        self._gear = None
        self._seat()

    def catch(self, q_rad: Array, qd_rad_s: Array) -> None:
        """Take joints over that move by themselves; brake, unless a motion has begun in this slice.  (6,), (6,)"""
        is_driven = self._is_driven
        self.hold(q_rad)
        self.setpoint.place(q_rad, qd_rad_s)
        self._seat()
        if not is_driven:
            self.begin_stop()

    def _stopping(self, speed: Array) -> Motion:
        stop_s = stop_time_s(speed)
        left, q = stop_s, self.setpoint.q_target
        while left > 0.0:
            now = max(0.0, left - SLICE_S)
            q = q + speed / stop_s * (left * left - now * now) / 2.0
            left = now
            self.put(q)
            yield
        # A slice at rest, so that nothing of the last step's speed is left to slow down.
        self.put(q)
        yield

    def _seat(self) -> None:
        self.nominal_rad = self.setpoint.q_target
        self._nominal_before = self.nominal_rad - self.setpoint.qd_target * SLICE_S
        self._shift = np.zeros(6)

    # --------------------------------------------------------------------------------------- force mode, freedrive

    def force_mode(self, task: ForceTask) -> None:
        """Comply from this slice on; a running force mode takes the new task. Without effect while paused."""
        if self.pace.is_paused:
            return
        self._law = ForceLaw(task, dt_s=SLICE_S, before=self._law)

    def end_force_mode(self) -> None:
        """Hold where complying led to."""
        if self._law is None:
            return
        self._law = None
        # What complied went by the clock.
        self._gear = None
        if not self._was_driven and not self._is_driven:
            self._seat()

    @property
    def force_task(self) -> ForceTask | None:
        """What force mode was told, None where it is off."""
        return None if self._law is None else self._law.task

    def freedrive(self, free_axes: Sequence[float] = (1, 1, 1, 1, 1, 1)) -> None:
        """Let the joints be led by hand; axes that are not free (base axes at the tool) are held.

        Without effect while paused.
        """
        if self.pace.is_paused:
            return
        self.tail = None
        self._free_axes = np.array(free_axes, dtype=bool)

    def end_freedrive(self) -> None:
        """Hold where the arm was led to."""
        self._free_axes = None

    def stiffen(self) -> None:
        """End force mode and freedrive; the arm is held."""
        self.end_force_mode()
        self.end_freedrive()

    @property
    def is_free(self) -> bool:
        """Freedrive is on."""
        return self._free_axes is not None
