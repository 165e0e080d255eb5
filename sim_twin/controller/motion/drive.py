"""The drive: set-points into the twin's servos, 2 ms of physics, measurements out; brakes where there is no power."""

from collections import deque
from collections.abc import Sequence
from operator import is_

import numpy as np

from sim_twin.controller.motion.actuation import BRAKE_NM, BRAKE_SOLIMP, HOLD_NM, servo_lag_s
from sim_twin.controller.motion.contact import ContactWatch
from sim_twin.controller.motion.core import MotionCore
from sim_twin.controller.motion.feeling import Feeling
from sim_twin.controller.motion.hidden import Hidden
from sim_twin.controller.motion.kinematics import ArmKinematics, KinematicsError, dh_rows
from sim_twin.controller.motion.limits import (
    Asked,
    Breach,
    Cause,
    SafetyLimits,
    breach_asked,
    breach_felt,
    default_limits,
    is_outside,
)
from sim_twin.controller.motion.measured import Measured
from sim_twin.controller.motion.motions import Motions
from sim_twin.controller.motion.poses import Array, vec6
from sim_twin.controller.motion.setpoint import SLICE_S
from sim_twin.controller.motion.stopping import stop_path
from sim_twin.controller.motion.wrench import (
    NM_PER_A,
    ForceSensor,
)
from sim_twin.controller.states import MotionOrder
from sim_twin.plant import TwinWorld

__all__ = ["TwinDrive"]

HELD_RAD_S = 0.005
ASKED_RAD_S, STILL_RAD_S = 1e-6, 0.01
"""Slower than both a set-point and the joints stand."""
N_HISTORY = 1000
MOST_TOLD_KG, MOST_TOLD_M = 100.0, 10.0
"""Numbers beyond these are a slip, and great ones would overflow to a force that no limit compares with."""
MOST_EXTRA_KG = 20.0
GIVE_WAY_S = 0.25
"""For as long as a stop takes a collision leads the joints; after that they hold against whatever presses."""
_CONTACTS = (Cause.TOOL_COLLISION, Cause.JOINT_COLLISION, Cause.DEVIATION)


class TwinDrive:
    """Owns a twin's world and moves its arm. Starts with brakes on and no power.

    Args:
        world: The twin, with a tick of one slice.
        kinematics: The controller's idea of the arm; the arm file's where absent.
        limits: Safety limits; the arm file's where absent.

    Attributes:
        motions: What programs move the arm with.
        measured: After the last slice.
        hidden: What of the arm is not as anybody knows it.
        contact: Whether the tool met something (tool_contact).
        limits: Held from the next slice on.
        is_braked: The joints are locked and the servos have no power.
        n_slices: Slices since the start.

    Raises:
        ValueError: the world's tick is not one slice.
    """

    def __init__(
        self, world: TwinWorld, *, kinematics: ArmKinematics | None = None, limits: SafetyLimits | None = None
    ) -> None:
        if abs(world.tick_s - SLICE_S) > 1e-12:
            raise ValueError(f"twin's rig: expected tick_s {SLICE_S}, got {world.tick_s}; set it so in the rig")
        self.world = world
        self.kinematics = kinematics or ArmKinematics(dh_rows(world.arm))
        self.limits = limits or default_limits(world.arm)
        model, data = world.model, world.data
        self._controls = world.joint_controls
        self.hidden = Hidden(model, self._controls)
        self._lag_s = servo_lag_s(model, int(self._controls[0]), tick_s=world.tick_s)
        self._sensor = ForceSensor(model, (world.arm.tool.mass_kg, np.array(world.arm.tool.com_m)))
        self.motions = Motions(
            world.arm, kinematics=self.kinematics, q_rad=data.qpos[:6].copy(), servo_lag_s=self._lag_s
        )
        self._expected = data.qpos[:6].copy()
        self.contact = ContactWatch()
        self._history: deque[Array] = deque(maxlen=N_HISTORY)
        self.n_slices = 0
        self._torque_nm: Array | None = None
        self._is_compliant = False
        self._feeling = Feeling()
        self._n_struck = 0
        self._moved = np.zeros((3, 6))
        self._asked: tuple[object, ...] = (None, None, None)
        self._asked_m = np.zeros(3)
        self.lock()
        self.measured = self._read()

    @property
    def core(self) -> MotionCore:
        """What motions share."""
        return self.motions.core

    # ------------------------------------------------------------------------------------------------------- power

    def lock(self) -> None:
        """Cut the servos' power and let the brakes in: a moving arm is stopped by its brakes (category 0)."""
        model = self.world.model
        self._cut_servos()
        model.dof_frictionloss[:6] = BRAKE_NM
        model.dof_solimp[:6, :2] = BRAKE_SOLIMP
        self.is_braked = True
        self._feeling.begin(self.world.data.qvel[:6].copy())
        self._seat()

    def engage(self) -> None:
        """Give the servos power where the joints are and release the brakes."""
        model = self.world.model
        self._give_servos()
        model.dof_frictionloss[:6] = self.hidden.friction_nm
        self.is_braked = False
        self._feeling.begin(self.world.data.qvel[:6].copy())
        self._seat()

    def refresh(self) -> None:
        """Let what has changed of the hidden arm be felt at once, where the servos have power."""
        if not self.is_braked:
            self.world.model.dof_frictionloss[:6] = self.hidden.friction_nm
            self._give_servos()

    def put_torque(self, torque_nm: Sequence[float] | Array) -> None:
        """Move the joints by torques in this slice, beside what carries their weight; afterwards they are held.  (6,)

        Without effect while paused.

        Raises:
            MotionConflictError: another motion moves the arm in this slice.
            ValueError: they are not six finite numbers.
        """
        torque = vec6(torque_nm, "joint torques")
        greatest = np.array([j.torque_nm for j in self.world.arm.joints])
        if not self.core.pace.is_paused:
            self.core.claim()
            self._torque_nm = np.clip(torque, -greatest, greatest)

    def stiffen(self) -> None:
        """Let nothing comply nor be led, nor torques move the joints: no program may move."""
        self._drop_torque()
        self.core.stiffen()

    def _drop_torque(self) -> None:
        if self._torque_nm is not None:
            self._torque_nm = None
            self.core.release()

    def _cut_servos(self) -> None:
        model = self.world.model
        model.actuator_gainprm[self._controls] = 0.0
        model.actuator_biasprm[self._controls] = 0.0
        self._is_compliant = False

    def _give_servos(self) -> None:
        model = self.world.model
        model.actuator_gainprm[self._controls] = self.hidden.gains
        model.actuator_biasprm[self._controls] = self.hidden.biases
        self._is_compliant = False

    def _seat(self, moving_rad_s: Array | None = None) -> None:
        """Hold the joints where they are; joints that move are braked."""
        q = self.world.data.qpos[:6].copy()
        self.world.data.ctrl[self._controls] = q
        self._expected = q
        if moving_rad_s is None:
            self.core.hold(q)
        else:
            self.core.catch(q, moving_rad_s)

    # ------------------------------------------------------------------------------------------------------ sensing

    def set_payload(self, mass_kg: float, cog_m: Sequence[float] = (0.0, 0.0, 0.0), *, n_transition: int = 0) -> None:
        """Tell the controller what hangs on the flange; the force sensor's next reading is nothing, as on a robot.

        Args:
            mass_kg: How heavy it is.
            cog_m: Its centre of gravity, flange frame.
            n_transition: Slices after which the sensor is zeroed once more.

        Raises:
            ValueError: a mass below zero, or mass or place beyond anything that an arm carries.
        """
        if not 0.0 <= mass_kg <= MOST_TOLD_KG:
            raise ValueError(
                f"payload: expected 0 to {MOST_TOLD_KG:g} kg, got {mass_kg}; give the mass that hangs on the flange"
            )
        if not (np.abs(cog_m) <= MOST_TOLD_M).all():
            raise ValueError(f"payload: expected a centre of gravity within {MOST_TOLD_M:g} m, got {[*cog_m]}")
        next_slice = self.n_slices + 1
        known = (mass_kg, np.array(cog_m, dtype=np.float64))
        self._sensor.tell(known, zeroing=(next_slice, next_slice + n_transition))

    def hang(self, extra_kg: float) -> None:
        """Let so much more hang on the flange than the tool, without telling the controller; 0 takes it off.

        Raises:
            ValueError: a mass below zero or beyond what any arm of this kind carries.
        """
        if not 0.0 <= extra_kg <= MOST_EXTRA_KG:
            raise ValueError(f"payload: expected 0 to {MOST_EXTRA_KG:g} kg more, got {extra_kg}")
        tool = self.world.arm.tool
        self._sensor.hang((tool.mass_kg + extra_kg, np.array(tool.com_m)))
        self.hidden.carry(extra_kg)

    @property
    def payload(self) -> tuple[float, Array]:
        """Mass (kg) and centre of gravity (m, flange frame) as told."""
        return self._sensor.told

    def zero_force(self) -> None:
        """Take what the force sensor reads now as nothing (zero_ftsensor)."""
        self._sensor.zero(self.measured.wrench)

    def joint_history(self, n_slices: int) -> Array:
        """Return the joints measured some slices ago, the first of all where there were fewer.  () -> (6,)

        Raises:
            ValueError: that is longer ago than they are kept.
        """
        if not 0 <= n_slices < N_HISTORY:
            raise ValueError(f"expected 0 to {N_HISTORY - 1} time steps, got {n_slices}")
        return self._history[max(-len(self._history), -1 - n_slices)] if self._history else self.measured.q_rad

    # -------------------------------------------------------------------------------------------------- one slice

    def tick(self) -> Breach | None:
        """End the slice, let 2 ms pass and measure; return the first limit that was passed.

        Whatever passes a limit is not asked of the servos: the arm stops by itself (category 2) on a protective stop
        and is cut and braked (category 0) on a violation. The caller tells the modes and the program.
        """
        data = self.world.data
        torque_nm, self._torque_nm = None if self.is_braked else self._torque_nm, None
        if torque_nm is None and self._is_compliant:
            self._give_servos()
            self._seat(data.qvel[:6].copy())
        breach = None if self.is_braked or torque_nm is not None else self._drive()
        if self.is_braked:
            data.ctrl[self._controls] = data.qpos[:6]
            if float(np.abs(data.qvel[:6]).max()) < HELD_RAD_S:
                self.world.model.dof_frictionloss[:6] = HOLD_NM
            self.core.hold(data.qpos[:6].copy())
        elif torque_nm is not None:
            self._cut_servos()
            self._is_compliant = True
            data.qfrc_applied[:6] += torque_nm
        else:
            data.ctrl[self._controls] = self.motions.setpoint.q_target
        self.world.clock.wait_tick()
        if torque_nm is not None:
            data.qfrc_applied[:6] -= torque_nm
            self._seat()
        self.n_slices += 1
        self.measured = self._read()
        self._history.append(self.measured.q_rad)
        self.contact.push(self.measured.wrench[:3], self.measured.tcp_speed[:3])
        if breach is None and not self.is_braked:
            felt = self._feeling.take(self.measured, self._expected, self.limits.tool_force_n)
            # Nobody asked for where torques lead: what is measured is judged as what is asked.
            breach = breach_felt(self.limits, felt) or (None if torque_nm is None else self._led_beyond())
            if breach is not None:
                self._stop_for(breach.cause)
            self._n_struck = self._n_struck + 1 if breach is not None and breach.cause in _CONTACTS else 0
        return breach

    def _stop_for(self, cause: Cause) -> None:
        """Stop for what was felt. What struck something stops from where that held it, and does not press on."""
        if cause in _CONTACTS and not self._is_compliant and self._n_struck * SLICE_S < GIVE_WAY_S:
            self._seat(self.measured.qd_rad_s)
        else:
            self.stop(is_cut=cause.is_violation)

    def stop(self, *, is_cut: bool = False) -> None:
        """Stop as fast as the arm may and hold, or cut the drives and brake."""
        if is_cut:
            self.lock()
        elif not self.is_braked:
            self._drop_torque()
            self.core.begin_stop()

    def obey(self, order: MotionOrder) -> None:
        """Do what the modes' reaction asks of the motion."""
        pace = self.core.pace
        pace.is_paused = order is MotionOrder.PAUSE or (pace.is_paused and order is MotionOrder.NONE)
        if order is MotionOrder.PAUSE:
            # Force mode slows down first: it ends when the arm rests, freedrive at once.
            self.core.end_freedrive()
        elif order is MotionOrder.RESUME:
            self.core.stiffen()
        elif order is MotionOrder.CUT:
            self.lock()
        elif order is MotionOrder.STOP:
            self.stop()
        elif order is MotionOrder.ENGAGE:
            self.engage()

    @property
    def is_standing(self) -> bool:
        """Set-point and joints are at rest, whatever is read of them."""
        asked, measured = self.motions.setpoint.qd_target.tolist(), self.world.data.qvel[:6].tolist()
        return all(-ASKED_RAD_S < v < ASKED_RAD_S for v in asked) and all(
            -STILL_RAD_S < v < STILL_RAD_S for v in measured
        )

    @property
    def is_led_by_torque(self) -> bool:
        """A program's torques move the joints."""
        return self._is_compliant

    @property
    def deviation_ratio(self) -> float:
        """How far the joints are off where the servos should have brought them; at 1 that is a stop (C153)."""
        return float(np.abs(self._expected - self.measured.q_rad).max()) / self.limits.deviation_rad

    @property
    def is_outside(self) -> bool:
        """The arm stands beyond a joint's limit or a plane by more than its tolerance."""
        return is_outside(self.limits, self.measured.q_rad, self.measured.tcp_pose[:3])

    def _drive(self) -> Breach | None:
        core, setpoint = self.core, self.motions.setpoint
        before_m = self._asked_tool_m()
        try:
            core.end_slice(self.measured)
        except KinematicsError as error:
            core.refuse(self.measured, is_moved=False)
            return Breach(cause=Cause.SINGULARITY, text=str(error))
        breach = None
        if not core.is_stopping:
            asked = Asked(
                q_rad=setpoint.q_target,
                qd_rad_s=setpoint.qd_target,
                tool_m=self._asked_tool_m(),
                tool_before_m=before_m,
                tool_stop_m=self._stop_m(setpoint.q_target, setpoint.qd_target),
            )
            breach = breach_asked(self.limits, asked)
        if breach is not None:
            core.refuse(self.measured)
        # A first-order lag of the set-points: where the servo should have brought the joints by now.
        self._expected = self._expected + SLICE_S / (SLICE_S + self._lag_s) * (setpoint.q_target - self._expected)
        return breach

    def _asked_tool_m(self) -> Array:
        """Where the set-point brings the tool: found once for each; neither is ever written into."""
        asked = self.motions.setpoint.q_target, self.core.T_ft, self.kinematics.rows
        if not all(map(is_, asked, self._asked)):
            self._asked, self._asked_m = asked, self.core.tool_at(asked[0])[:3, 3]
        return self._asked_m

    def _stop_m(self, q_rad: Array, qd_rad_s: Array) -> tuple[Array, ...]:
        """Return where a stop that began now would bring the tool, half-way and at its end, where planes ask for it."""
        if not self.limits.planes:
            return ()
        return tuple(self.core.tool_at(q)[:3, 3] for q in stop_path(q_rad, qd_rad_s))

    def _led_beyond(self) -> Breach | None:
        now = self.measured
        tool_m = now.tcp_pose[:3]
        led = Asked(
            q_rad=now.q_rad,
            qd_rad_s=now.qd_rad_s,
            tool_m=tool_m,
            tool_before_m=tool_m - now.tcp_speed[:3] * SLICE_S,
            tool_stop_m=self._stop_m(now.q_rad, now.qd_rad_s),
        )
        return breach_asked(self.limits, led)

    def _read(self) -> Measured:
        model, data = self.world.model, self.world.data
        q, qd = data.qpos[:6].copy(), data.qvel[:6].copy()
        self._moved = moved = self.kinematics.tool_motion(q, qd, self.core.T_ft, self._moved)
        tcp_pose, tcp_speed, flange = moved
        T_bf = self.kinematics.forward(q) if self._sensor.is_biased else None
        wrench = self._sensor.read(model, data, tcp_pose[:3], T_bf, self.n_slices)
        # Brakes hold without power, and the twin carries the weight whatever does.
        torque = np.zeros(6) if self.is_braked else data.qfrc_actuator[:6] + data.qfrc_gravcomp[:6]
        return Measured(
            q_rad=q,
            qd_rad_s=qd,
            tcp_pose=tcp_pose,
            tcp_speed=tcp_speed,
            acceleration=flange[:3],
            wrench=wrench,
            torque_nm=torque,
            current_a=torque / NM_PER_A,
            external_nm=data.qfrc_constraint[:6].copy(),
        )
