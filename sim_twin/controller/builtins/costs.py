"""What calls of a robot's functions cost a slice: as measured on one machine, in steps of 0.1 µs, rounded up.

What is not here takes less than 3 µs and costs what script/costs.py says. A function that takes longer than it costs
lets a loop that never ends hold the controller for longer than a slice's budget; the other way round it ends programs
that a robot would run.
"""

__all__ = ["COSTS"]

_INVERSE = 9_000
"""Inverse kinematics takes 3,100 for the nominal arm and 8,500 for a calibrated one."""
COSTS: dict[str, int] = {
    "direct_torque": 300,
    "enable_external_ft_sensor": 100,
    "force": 30,
    "force_mode": 200,
    "freedrive_mode": 200,
    "get_actual_tool_flange_pose": 140,
    "get_coriolis_and_centrifugal_torques": 180,
    "get_forward_kin": 240,
    "get_inverse_kin": _INVERSE,
    "get_inverse_kin_has_solution": _INVERSE,
    "get_jacobian": 170,
    "get_jacobian_time_derivative": 280,
    "get_mass_matrix": 100,
    "get_target_tcp_pose": 180,
    "get_target_tcp_speed": 180,
    "get_target_waypoint": 180,
    "get_tcp_offset": 40,
    "interpolate_pose": 60,
    "inv": 150,
    "is_within_safety_limits": 11_000,
    "movec": 8_000,
    "movej": 8_000,
    "movel": 8_000,
    "movep": 8_000,
    "optimovej": 8_000,
    "optimovel": 8_000,
    "popup": 400,
    "pose_add": 40,
    "pose_dist": 40,
    "pose_inv": 40,
    "pose_sub": 40,
    "pose_trans": 50,
    "rotvec2rpy": 90,
    "rpy2rotvec": 50,
    "rtde_set_watchdog": 50,
    "servoc": 8_000,
    "servoj": 800,
    "set_payload": 60,
    "set_payload_mass": 60,
    "set_target_payload": 80,
    "set_tcp": 120,
    "socket_open": 1_000,
    "speedj": 200,
    "speedl": 900,
    "stopj": 200,
    "stopl": 500,
    "textmsg": 400,
    "to_num": 30,
    "tool_contact": 150,
    "wrench_trans": 60,
}
