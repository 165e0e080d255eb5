"""The robot as the dashboard and the state ports see it."""

import struct
import zlib

from sim_twin.controller.builtins.state import CONTROLLER_C, JOINT_C
from sim_twin.controller.machine import Machine
from sim_twin.controller.modes import Modes
from sim_twin.controller.motion import DhRow
from sim_twin.controller.motion.poses import Array
from sim_twin.controller.outputs import elbow, elbow_velocity, joint_mode, momentum_n_s, robot_current_a
from sim_twin.controller.program import UNNAMED, Programs
from sim_twin.controller.script.builtins import Popup
from sim_twin.controller.states import Event, RuntimeState, SafetyMode
from sim_twin.controller.wire import Awaited, DashboardStatus, Outcome
from sim_twin.controller.wire.primary_state import (
    AdditionalInfo,
    CartesianInfo,
    ConfigurationData,
    ForceModeData,
    JointData,
    KinematicsInfo,
    MasterboardData,
    PrimaryState,
    RobotModeData,
    ToolData,
    Vec6,
)
from sim_twin.controller.wire.realtime import RealtimeState

__all__ = ["Panel"]

_STATES = {
    RuntimeState.PLAYING: "PLAYING",
    RuntimeState.RESUMING: "PLAYING",
    RuntimeState.PAUSING: "PAUSED",
    RuntimeState.PAUSED: "PAUSED",
}
_STARTED = {True: Outcome.DONE, False: Outcome.FAILED, None: None}
_ESTOPS = (SafetyMode.SYSTEM_EMERGENCY_STOP, SafetyMode.ROBOT_EMERGENCY_STOP)
_JOINTS_C: Vec6 = (JOINT_C, JOINT_C, JOINT_C, JOINT_C, JOINT_C, JOINT_C)
_ROW = struct.Struct(">4d")
_NOT_CALIBRATED, _CALIBRATED = 0, 2
"""UR's controller calls them "not initialised" and "linearised"; 1 is "not linearised"."""
_POSITION, _TEACH, _FORCE, _TORQUE = 0, 1, 2, 3


class Panel:
    """wire.DashboardTarget and wire.StateSource.

    Args:
        machine: The controller's state.
        programs: Its programs.

    Attributes:
        operational_mode: As the dashboard set it.
        is_shut_down: Somebody switched the controller off.
    """

    def __init__(self, machine: Machine, programs: Programs) -> None:
        self._machine, self._programs = machine, programs
        self.operational_mode = "NONE"
        self.is_shut_down = False

    # ---------------------------------------------------------------------------------------------------- dashboard

    def status(self) -> DashboardStatus:
        """Return what holds now."""
        modes, programs = self._machine.modes, self._programs
        state = _STATES.get(modes.runtime, "STOPPED")
        running = programs.main
        name = (running.name or UNNAMED) if running is not None else programs.loaded
        return DashboardStatus(
            robot_mode=modes.robot.name,
            safety_mode=modes.safety.name,
            safety_status=modes.safety.name,
            program_state=state,
            program=name,
            is_running=state == "PLAYING",
            is_remote=modes.is_remote,
            operational_mode=self.operational_mode,
        )

    def power_on(self) -> Outcome:
        """Power the arm."""
        return self._happen(Event.POWER_ON)

    def power_off(self) -> Outcome:
        """Take the arm's power."""
        return self._happen(Event.POWER_OFF, Event.STOP)

    def brake_release(self) -> Outcome:
        """Open the brakes."""
        return self._happen(Event.BRAKE_RELEASE)

    def unlock_protective_stop(self) -> Outcome:
        """Leave a protective stop."""
        refusal = self._programs.handle(Event.UNLOCK_PROTECTIVE_STOP).refusal
        if refusal is None:
            return Outcome.DONE
        return Outcome.TOO_EARLY if refusal == Modes.TOO_EARLY else Outcome.FAILED

    def close_safety_popup(self) -> Outcome:
        """There is none to close."""
        return Outcome.DONE

    def restart_safety(self) -> Outcome:
        """Restart the safety system."""
        return self._happen(Event.RESTART_SAFETY)

    def shutdown(self) -> Outcome:
        """Switch the controller off; who runs it looks."""
        self.is_shut_down = True
        return Outcome.DONE

    def play(self) -> Awaited:
        """Start the loaded program, or resume a paused one. Whether it starts is known once it is compiled."""
        modes, programs = self._machine.modes, self._programs
        if modes.runtime is RuntimeState.PAUSED:
            resumed = self._happen(Event.PLAY)
            return lambda: resumed
        if programs.loaded is None or programs.refusal is not None or modes.runtime is not RuntimeState.STOPPED:
            return lambda: Outcome.FAILED
        start = programs.submit(programs.shelf[programs.loaded], is_remote=modes.is_remote)
        return lambda: _STARTED[start.has_begun]

    def stop(self) -> Outcome:
        """Stop whatever runs or is about to; UR answers alike where nothing does."""
        self._programs.stop()
        return Outcome.DONE

    def pause(self) -> Outcome:
        """Pause what runs; what was sent before does not replace it any more."""
        return Outcome.DONE if self._programs.pause().refusal is None else Outcome.FAILED

    def load(self, path: str) -> Outcome:
        """Load a program of the shelf."""
        programs = self._programs
        if path not in programs.shelf:
            return Outcome.NOT_FOUND
        programs.loaded = path
        return Outcome.DONE

    def load_installation(self, path: str) -> Outcome:  # noqa: ARG002 - there is one installation only
        """There are none to load."""
        return Outcome.NOT_FOUND

    def popup(self, text: str) -> Outcome:
        """Show a popup."""
        self._machine.journal.show(
            Popup(text=text, title="Dashboard", is_warning=False, is_error=False, is_blocking=False)
        )
        return Outcome.DONE

    def close_popup(self) -> Outcome:
        """Close it."""
        self._machine.journal.popup = None
        return Outcome.DONE

    def add_to_log(self, text: str) -> Outcome:
        """Write a line to the log."""
        self._machine.journal.note(text)
        return Outcome.DONE

    def set_operational_mode(self, mode: str) -> Outcome:
        """Choose manual or automatic."""
        self.operational_mode = mode
        return Outcome.DONE

    def clear_operational_mode(self) -> Outcome:
        """Give that choice back."""
        self.operational_mode = "NONE"
        return Outcome.DONE

    def set_user_role(self, role: str) -> Outcome:  # noqa: ARG002 - roles change nothing here
        """Take a role."""
        return Outcome.DONE

    def _happen(self, *events: Event) -> Outcome:
        refusals = [self._programs.handle(event).refusal for event in events]
        return Outcome.DONE if refusals[0] is None else Outcome.FAILED

    # --------------------------------------------------------------------------------------------------- state ports

    def primary_state(self) -> PrimaryState:
        """Return the state for 30001 and 30002."""
        machine = self._machine
        measured, io, core = machine.drive.measured, machine.io, machine.drive.core
        mode = joint_mode(machine)
        return PrimaryState(
            mode=self._mode_data(),
            joints=JointData(
                q_rad=_six(measured.q_rad),
                q_target_rad=_six(machine.drive.motions.setpoint.q_target),
                qd_rad_s=_six(measured.qd_rad_s),
                current_a=_six(measured.current_a),
                motor_temperature_c=_JOINTS_C,
                mode=(mode, mode, mode, mode, mode, mode),
            ),
            tool=ToolData(
                analog_inputs=(io.tool_analog_in[0], io.tool_analog_in[1]),
                output_voltage_v=io.tool_voltage_v,
                temperature_c=JOINT_C,
                mode=mode,
            ),
            masterboard=MasterboardData(
                digital_inputs=io.digital_in,
                digital_outputs=io.digital_out,
                analog_input_ranges=(io.analog_in_domain[0], io.analog_in_domain[1]),
                analog_inputs=(io.analog_input(0), io.analog_input(1)),
                analog_output_domains=(io.analog_out_domain[0], io.analog_out_domain[1]),
                analog_outputs=(io.analog_output(0), io.analog_output(1)),
                temperature_c=CONTROLLER_C,
                robot_current_a=robot_current_a(measured),
                safety_mode=int(machine.modes.safety),
                is_reduced=machine.modes.is_reduced,
            ),
            cartesian=CartesianInfo(tcp_pose=_six(measured.tcp_pose), tcp_offset=_six(core.tcp_offset)),
            kinematics=self._kinematics_info(),
            configuration=self._configuration(),
            force_mode=ForceModeData(wrench=_six(measured.wrench)),
            additional=AdditionalInfo(is_freedrive_enabled=core.is_free),
        )

    def realtime_state(self) -> RealtimeState:
        """Return the state for 30003."""
        machine = self._machine
        drive, modes, io = machine.drive, machine.modes, machine.io
        measured, setpoint = drive.measured, drive.motions.setpoint
        pose, speed = machine.target_tool()
        cog, mode, rows = drive.payload[1], joint_mode(machine), drive.kinematics.rows
        return RealtimeState(
            time_s=machine.time_s,
            q_target_rad=_six(setpoint.q_target),
            qd_target_rad_s=_six(setpoint.qd_target),
            qdd_target_rad_s2=_six(setpoint.qdd_target),
            current_target_a=_six(measured.current_a),
            moment_target_nm=_six(measured.torque_nm),
            q_rad=_six(measured.q_rad),
            qd_rad_s=_six(measured.qd_rad_s),
            current_a=_six(measured.current_a),
            control_current_a=_six(measured.current_a),
            tcp_pose=_six(measured.tcp_pose),
            tcp_speed=_six(measured.tcp_speed),
            tcp_force_n=_six(measured.wrench),
            tcp_pose_target=_vec6(pose),
            tcp_speed_target=_vec6(speed),
            digital_inputs=io.digital_in,
            motor_temperature_c=_JOINTS_C,
            controller_timer_ms=machine.execution_s * 1e3,
            robot_mode=int(modes.robot),
            joint_modes=(mode, mode, mode, mode, mode, mode),
            safety_mode=int(modes.safety),
            tool_acceleration_m_s2=machine.tool_acceleration(),
            speed_scaling=drive.core.pace.scale,
            momentum_norm=momentum_n_s(machine),
            digital_outputs=io.digital_out,
            program_state=int(modes.runtime),
            robot_current_a=robot_current_a(measured),
            elbow_position_m=elbow(rows, measured.q_rad),
            elbow_velocity_m_s=elbow_velocity(rows, measured.q_rad, measured.qd_rad_s),
            safety_status=int(modes.safety),
            payload_kg=drive.payload[0],
            payload_cog_m=(float(cog[0]), float(cog[1]), float(cog[2])),
            payload_inertia_kg_m2=_vec6(machine.payload_inertia),
        )

    def _mode_data(self) -> RobotModeData:
        machine = self._machine
        modes, pace = machine.modes, machine.drive.core.pace
        return RobotModeData(
            timestamp_us=machine.stamp_us,
            is_power_on=bool(modes.robot_status_bits & 1),
            is_emergency_stopped=modes.safety in _ESTOPS,
            is_protective_stopped=modes.safety is SafetyMode.PROTECTIVE_STOP,
            is_program_running=modes.runtime in (RuntimeState.PLAYING, RuntimeState.RESUMING),
            is_program_paused=modes.runtime in (RuntimeState.PAUSED, RuntimeState.PAUSING),
            robot_mode=int(modes.robot),
            control_mode=self._control_mode(),
            target_speed_fraction=pace.slider,
            speed_scaling=pace.scale,
        )

    def _control_mode(self) -> int:
        drive = self._machine.drive
        core = drive.core
        if drive.is_led_by_torque:
            return _TORQUE
        return _TEACH if core.is_free else _POSITION if core.force_task is None else _FORCE

    def _kinematics_info(self) -> KinematicsInfo:
        kinematics = self._machine.drive.kinematics
        rows = kinematics.rows
        return KinematicsInfo(
            checksum=_checksum(rows),
            dh_theta_rad=_vec6([r.theta_rad for r in rows]),
            dh_a_m=_vec6([r.a_m for r in rows]),
            dh_d_m=_vec6([r.d_m for r in rows]),
            dh_alpha_rad=_vec6([r.alpha_rad for r in rows]),
            calibration_status=_NOT_CALIBRATED if rows == kinematics.nominal else _CALIBRATED,
        )

    def _configuration(self) -> ConfigurationData:
        limits, joints = self._machine.drive.limits, self._machine.world.arm.joints
        return ConfigurationData(
            q_limits_rad=tuple(zip(limits.q_min_rad, limits.q_max_rad, strict=True)),
            qd_limits_rad_s=_vec6(limits.speed_rad_s),
            qdd_limits_rad_s2=_vec6([j.acceleration_rad_s2 for j in joints]),
            dh_a_m=_vec6([j.a_m for j in joints]),
            dh_d_m=_vec6([j.d_m for j in joints]),
            dh_alpha_rad=_vec6([j.alpha_rad for j in joints]),
        )


def _checksum(rows: tuple[DhRow, ...]) -> tuple[int, int, int, int, int, int]:
    """Return a number a row that tells it from others; how UR finds its own is not public."""
    a, b, c, d, e, f = (zlib.crc32(_ROW.pack(r.theta_rad, r.a_m, r.d_m, r.alpha_rad)) for r in rows)
    return a, b, c, d, e, f


def _vec6(values: list[float] | tuple[float, ...]) -> Vec6:
    a, b, c, d, e, f = values
    return a, b, c, d, e, f


def _six(array: Array) -> Vec6:
    return _vec6(array.tolist())
