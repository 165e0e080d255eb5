"""servoj: a stream of joint targets, smoothed."""

from collections.abc import Sequence

from sim_twin.controller.motion.core import Motion, MotionCore, Tail
from sim_twin.controller.motion.poses import Array, vec6
from sim_twin.controller.motion.servo import ServoFilter, filter_lag_s
from sim_twin.controller.motion.setpoint import SLICE_S

__all__ = ["Servoing"]


class Servoing:
    """servoj as a generator; resume it once a slice.

    Args:
        core: What motions share.
    """

    def __init__(self, core: MotionCore) -> None:
        self._core = core
        self._target = core.setpoint.q_target

    def servoj(
        self,
        q: Sequence[float] | Array,
        a: float = 0.0,  # noqa: ARG002 - UR takes and ignores both
        v: float = 0.0,  # noqa: ARG002
        t: float = SLICE_S,
        lookahead_time: float = 0.1,
        gain: float = 300.0,
    ) -> Motion:
        """Move towards joint angles for a time; without another call the arm comes to rest on them.

        Raises:
            ValueError: look-ahead or gain outside UR's ranges.
        """
        core = self._core
        target = vec6(q)
        lag_s = filter_lag_s(
            lookahead_s=lookahead_time, gain=gain, dead_time_s=core.dead_time_s, servo_lag_s=core.servo_lag_s
        )
        smoothing = core.tail.servo if core.tail else None
        if smoothing is None or smoothing.lag_s != lag_s:
            smoothing = ServoFilter(
                core.setpoint.q_target, core.setpoint.qd_target, lag_s, speed_rad_s=core.speed_rad_s
            )
        core.begin_free()
        self._target = target
        going_on = self._go_on(smoothing)
        elapsed_s = 0.0
        while True:
            elapsed_s += SLICE_S * core.pace.scale
            next(going_on)
            yield
            if elapsed_s >= t - 1e-9:
                core.tail = Tail(going_on, servo=smoothing)
                return

    def _go_on(self, smoothing: ServoFilter) -> Motion:
        core = self._core
        n_stops = core.n_stops
        while True:
            if n_stops != core.n_stops:
                n_stops = core.n_stops
                smoothing.seat(core.setpoint.q_target, core.setpoint.qd_target)
            # A jump is handed on as it is, for the limits to refuse.
            is_far = smoothing.is_far(self._target)
            core.put(self._target if is_far else smoothing.step(self._target, SLICE_S * core.pace.scale))
            yield
