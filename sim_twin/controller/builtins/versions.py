"""The versions that brought URScript's functions, where a public client's script tells: it asks what it may call.

Taken from the conditions in the scripts of ur_rtde 1.6.5 and of Universal_Robots_Client_Library. What one of them calls
at a lower version than the other was there before. A function that is not here is given to every version.
"""

from typing import Final, TypeAlias

from sim_twin.controller.script import Builtins
from sim_twin.controller.wire import ControllerVersion

__all__ = ["ANY", "SINCE", "known_to"]

Since: TypeAlias = "tuple[tuple[int, ...] | None, tuple[int, ...] | None]"

ANY: Final = (0,)
"""No version is known before which it was not there."""
_DYNAMICS: Since = (5, 23), None

SINCE: dict[str, Since] = {
    "direct_torque": _DYNAMICS,
    "force_mode_set_damping": (ANY, (3, 5)),
    "ft_rtde_input_enable": ((5, 9), (3, 14, 1)),
    "get_actual_joint_positions_history": ((5, 4), ANY),
    "get_coriolis_and_centrifugal_torques": _DYNAMICS,
    "get_freedrive_status": ((5, 10), ANY),
    "get_inverse_kin_has_solution": ((5, 10), (3, 15)),
    "get_jacobian": _DYNAMICS,
    "get_jacobian_time_derivative": _DYNAMICS,
    "get_mass_matrix": _DYNAMICS,
    "get_steptime": ((5, 4), ANY),
    "get_target_joint_accelerations": _DYNAMICS,
    "get_target_payload_inertia": ((5, 10), ANY),
    "get_target_waypoint": ((5, 3), ANY),
    "get_tcp_offset": (ANY, (3, 6)),
    "optimovej": ((5, 21), None),
    "optimovel": ((5, 21), None),
    "protective_stop": (ANY, (3, 8)),
    "set_target_payload": ((5, 10), ANY),
    "tool_contact": ((5, 4), ANY),
}
"""First version of an e-Series and of a CB3; None where that box never got it."""


def known_to(version: ControllerVersion, builtins: Builtins) -> Builtins:
    """Return the functions that a controller of this version has."""
    return {name: call for name, call in builtins.items() if version.has(*SINCE.get(name, (ANY, ANY)))}
