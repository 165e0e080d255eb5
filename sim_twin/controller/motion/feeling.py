"""What the limits are judged by: measurements, smoothed. A blow of a millisecond passes through no real sensor."""

import numpy as np

from sim_twin.controller.motion.limits import FORCE_TOLERANCE_N, Felt
from sim_twin.controller.motion.measured import Measured
from sim_twin.controller.motion.poses import Array, length
from sim_twin.controller.motion.setpoint import SLICE_S

__all__ = ["Feeling"]

FELT_S = 0.02
"""Time constant of the forces and speeds that limits are judged by. A guess: UR publishes none."""


class Feeling:
    """Smooths forces and speeds, for a servo's overshoot is no runaway; knows how long the tool has been pressed."""

    def __init__(self) -> None:
        self.begin(np.zeros(6))

    def begin(self, qd_rad_s: Array) -> None:
        """Forget what was felt before the power was cut or given.  (6,)"""
        self._force_n, self._nm = 0.0, np.zeros(6)
        self._rad_s, self._m_s = qd_rad_s, 0.0
        self._n_pressed = 0

    def take(self, now: Measured, q_expected_rad: Array, most_n: float) -> Felt:
        """Take in a slice's measurement and return what is felt.

        Args:
            now: The measurement.
            q_expected_rad: Where the servos should have brought the joints by now.  (6,)
            most_n: The greatest force on the tool that is no collision.
        """
        share = SLICE_S / (SLICE_S + FELT_S)
        self._force_n += share * (length(now.wrench[:3]) - self._force_n)
        self._nm += share * (now.external_nm - self._nm)
        self._rad_s += share * (now.qd_rad_s - self._rad_s)
        self._m_s += share * (length(now.tcp_speed[:3]) - self._m_s)
        self._n_pressed = 0 if self._force_n <= most_n + FORCE_TOLERANCE_N else self._n_pressed + 1
        return Felt(
            q_rad=now.q_rad,
            qd_rad_s=self._rad_s,
            q_expected_rad=q_expected_rad,
            tool_m=now.tcp_pose[:3],
            tool_velocity_m_s=now.tcp_speed[:3],
            tool_speed_m_s=self._m_s,
            force_n=self._force_n,
            pressed_s=self._n_pressed * SLICE_S,
            external_nm=self._nm,
        )
