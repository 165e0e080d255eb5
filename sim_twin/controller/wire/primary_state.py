"""What the 10 Hz state of ports 30001 and 30002 is made of, in the order in which it travels."""

import msgspec

__all__ = [
    "AdditionalInfo",
    "CartesianInfo",
    "ConfigurationData",
    "ForceModeData",
    "JointData",
    "KinematicsInfo",
    "MasterboardData",
    "PrimaryState",
    "RobotModeData",
    "ToolData",
    "Vec6",
]

Vec6 = tuple[float, float, float, float, float, float]
_ZERO: Vec6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_48_V: Vec6 = (48.0, 48.0, 48.0, 48.0, 48.0, 48.0)
_25_C: Vec6 = (25.0, 25.0, 25.0, 25.0, 25.0, 25.0)


class RobotModeData(msgspec.Struct, frozen=True, kw_only=True):
    """Sub-package 0. Speed fractions are 0 to 1; the modes are UR's numbers."""

    timestamp_us: int
    is_real_robot_connected: bool = True
    is_real_robot_enabled: bool = True
    is_power_on: bool
    is_emergency_stopped: bool = False
    is_protective_stopped: bool = False
    is_program_running: bool = False
    is_program_paused: bool = False
    robot_mode: int
    control_mode: int = 0
    target_speed_fraction: float = 1.0
    speed_scaling: float = 1.0
    target_speed_fraction_limit: float = 1.0


class JointData(msgspec.Struct, frozen=True, kw_only=True):
    """Sub-package 1, one tuple per quantity, joints base to wrist 3."""

    q_rad: Vec6
    q_target_rad: Vec6
    qd_rad_s: Vec6
    current_a: Vec6 = _ZERO
    voltage_v: Vec6 = _48_V
    motor_temperature_c: Vec6 = _25_C
    mode: tuple[int, int, int, int, int, int] = (253, 253, 253, 253, 253, 253)


class ToolData(msgspec.Struct, frozen=True, kw_only=True):
    """Sub-package 2."""

    analog_input_ranges: tuple[int, int] = (0, 0)
    analog_inputs: tuple[float, float] = (0.0, 0.0)
    voltage_48v_v: float = 48.0
    output_voltage_v: int = 0
    current_a: float = 0.0
    temperature_c: float = 25.0
    mode: int = 253


class MasterboardData(msgspec.Struct, frozen=True, kw_only=True):
    """Sub-package 3, without a Euromap 67 interface."""

    digital_inputs: int = 0
    digital_outputs: int = 0
    analog_input_ranges: tuple[int, int] = (0, 0)
    analog_inputs: tuple[float, float] = (0.0, 0.0)
    analog_output_domains: tuple[int, int] = (0, 0)
    analog_outputs: tuple[float, float] = (0.0, 0.0)
    temperature_c: float = 25.0
    voltage_48v_v: float = 48.0
    robot_current_a: float = 0.0
    io_current_a: float = 0.0
    safety_mode: int = 1
    is_reduced: bool = False
    operational_mode_selector: int = 0
    three_position_enabling: int = 0


class CartesianInfo(msgspec.Struct, frozen=True, kw_only=True):
    """Sub-package 4: positions in metres and a rotation vector in radians, base frame; the TCP in the flange frame."""

    tcp_pose: Vec6
    tcp_offset: Vec6 = _ZERO


class KinematicsInfo(msgspec.Struct, frozen=True, kw_only=True):
    """Sub-package 5: the calibrated Denavit-Hartenberg parameters, and UR's checksum of them."""

    checksum: tuple[int, int, int, int, int, int]
    dh_theta_rad: Vec6
    dh_a_m: Vec6
    dh_d_m: Vec6
    dh_alpha_rad: Vec6
    calibration_status: int = 0


class ConfigurationData(msgspec.Struct, frozen=True, kw_only=True):
    """Sub-package 6: limits, defaults and the nominal Denavit-Hartenberg parameters."""

    q_limits_rad: tuple[tuple[float, float], ...]
    qd_limits_rad_s: Vec6
    qdd_limits_rad_s2: Vec6
    joint_speed_default_rad_s: float = 1.05
    joint_acceleration_default_rad_s2: float = 1.4
    tool_speed_default_m_s: float = 0.25
    tool_acceleration_default_m_s2: float = 1.2
    equivalent_radius_m: float = 0.25
    dh_a_m: Vec6
    dh_d_m: Vec6
    dh_alpha_rad: Vec6
    dh_theta_rad: Vec6 = _ZERO
    masterboard_version: int = 0
    controller_box_type: int = 0
    robot_type: int = 1
    robot_sub_type: int = 2


class ForceModeData(msgspec.Struct, frozen=True, kw_only=True):
    """Sub-package 7."""

    wrench: Vec6 = _ZERO
    dexterity: float = 0.0


class AdditionalInfo(msgspec.Struct, frozen=True, kw_only=True):
    """Sub-package 8: the freedrive button."""

    button_state: int = 0
    is_freedrive_enabled: bool = False
    is_io_freedrive_enabled: bool = False


class PrimaryState(msgspec.Struct, frozen=True, kw_only=True):
    """One robot state message; a part that is None is left out, as UR allows."""

    mode: RobotModeData
    joints: JointData | None = None
    tool: ToolData | None = None
    masterboard: MasterboardData | None = None
    cartesian: CartesianInfo | None = None
    kinematics: KinematicsInfo | None = None
    configuration: ConfigurationData | None = None
    force_mode: ForceModeData | None = None
    additional: AdditionalInfo | None = None
