"""From a target to the next tick's set-point: ruckig, with speed, acceleration and jerk bounded on every axis."""

import msgspec
import ruckig

__all__ = ["AxisLimits", "Limiter"]

EDGE = 1e-12
"""Share of its greatest speed within which an axis counts as about to reach it exactly."""


N_AHEAD = 4
"""So many ticks of a way are looked up at a time: ruckig's code is fetched into the caches once for them."""

State = tuple[list[float], list[float], list[float]]
"""Places, speeds and accelerations of the axes."""


class AxisLimits(msgspec.Struct, frozen=True, kw_only=True):
    """Greatest speed, acceleration and jerk of each axis, in the axes' own units."""

    speed: tuple[float, ...]
    acceleration: tuple[float, ...]
    jerk: tuple[float, ...]


class Limiter:
    """Moves n axes from where they are to a target that may change at any tick, and rests on it without overshoot.

    The axes are joints or the tool's coordinates; the limiter does not care.

    Attributes:
        is_failed: The last step met an input that ruckig refused; every axis brakes instead.
    """

    def __init__(self, limits: AxisLimits, *, tick_s: float) -> None:
        self._n = len(limits.speed)
        self._tick_s = tick_s
        self._speed, self._acceleration, self._jerk = list(limits.speed), list(limits.acceleration), list(limits.jerk)
        self._rest = [0.0] * self._n
        self._share = 1.0
        self.seed(self._rest)

    def seed(self, at: list[float], speed: list[float] | None = None, acceleration: list[float] | None = None) -> None:
        """Start at a place, at rest or on the move, aiming at that place; everything before is forgotten.

        Args:
            at: (n,)
            speed: (n,), at rest where absent.
            acceleration: (n,), none where absent; what is beyond the limits is left out.
        """
        self._otg = ruckig.Ruckig(self._n, self._tick_s)
        self._asked = self._bounded()
        rate = acceleration or self._rest
        held = [min(max(a, -most), most) for a, most in zip(rate, self._acceleration, strict=True)]
        self._put(at, speed or self._rest, held)
        self._asked.target_velocity = self._asked.target_acceleration = self._rest
        self._asked.target_position = self._target = at
        self._is_resting = self.is_failed = False

    def go_on(
        self, earlier: list[float], before: list[float], at: list[float], *, is_braking_kept: bool = False
    ) -> None:
        """Start on the move that three places a tick apart tell of, the newest last.  (n,), (n,), (n,)

        Their differences are means over ticks; the speed that there is at the end of the last is half a tick on.

        Args:
            earlier: places.
            before: places a tick later.
            at: where the axes are.
            is_braking_kept: an axis that was about to brake harder than the places tell goes on doing so. In short
                ticks one step of its jerk is less than what a limit takes off: begun anew with each tick a brake was
                never built up, and the tool went on away from its target, at the limit, until the gate stopped it.
        """
        dt, planned = self._tick_s, self.acceleration if is_braking_kept else None
        rate = [(c - 2.0 * b + a) / (dt * dt) for a, b, c in zip(earlier, before, at, strict=True)]
        rate = [min(max(a, -most), most) for a, most in zip(rate, self._acceleration, strict=True)]
        speed = [(c - b) / dt + 0.5 * dt * a for b, c, a in zip(before, at, rate, strict=True)]
        if planned is not None:
            rate = [(min if v > 0.0 else max)(a, p) for v, a, p in zip(speed, rate, planned, strict=True)]
        self.seed(at, speed, rate)

    @property
    def at(self) -> list[float]:
        """Where the axes are set to.  () -> (n,)"""
        return self._now[0]

    @property
    def speed(self) -> list[float]:
        """How fast they are set to go.  () -> (n,)"""
        return self._now[1]

    @property
    def acceleration(self) -> list[float]:
        """How fast that changes.  () -> (n,)"""
        return self._now[2]

    @property
    def target(self) -> list[float]:
        """Where they will rest.  () -> (n,)"""
        return self._target

    def slow_to(self, share: float) -> None:
        """Go no faster than a share of every axis's greatest speed from now on; what is faster brakes."""
        if share != self._share:
            self._share = share
            self._asked.max_velocity = [share * most for most in self._speed]
            self._is_resting, self._path = False, None

    def aim(self, target: list[float]) -> None:
        """Set where to rest.  (n,)"""
        if target == self._target:
            return
        self._target = target
        self._asked.target_position = target
        self._is_resting, self._path = False, None
        self.is_failed = False
        self._leave_edge()

    def _leave_edge(self) -> None:
        """Take off so little speed that no axis is about to reach its greatest exactly, as its acceleration runs out.

        There ruckig (0.19.4) finds no time-optimal path but one that slows down at once, as much as 60 ms longer.
        """
        at, speeds, rates = self._now
        for speed, rate, most, jerk in zip(speeds, rates, self._speed, self._jerk, strict=True):
            if speed * rate > 0.0 and abs(abs(speed) + rate * rate / (2.0 * jerk) - most) <= EDGE * most:
                self._now = at, [v * (1.0 - 2.0 * EDGE) for v in speeds], rates
                return

    def brake(self) -> list[float]:
        """Aim at the nearest place where the axes can come to rest, and return it.  () -> (n,)"""
        stopping = self._bounded()
        stopping.control_interface = ruckig.ControlInterface.Velocity
        stopping.current_position, stopping.current_velocity, stopping.current_acceleration = self._now
        stopping.target_velocity = stopping.target_acceleration = self._rest
        path = ruckig.Trajectory(self._n)
        try:
            self._otg.calculate(stopping, path)
        except ruckig.RuckigError:
            self.aim(self.at)
        else:
            self.aim(path.at_time(path.duration)[0])
        return self._target

    def step(self) -> list[float]:
        """Advance by one tick and return where the axes are set to.  () -> (n,)"""
        if self._is_resting:
            return self._target
        path = self._path
        if path is None:
            path = self._planned()
            if path is None:
                return self._brake_by_hand()
        if not self._to_come:
            self._look_along(path)
        self._time_s += self._tick_s
        if self._time_s > self._duration_s:
            self._put(self._target, self._rest, self._rest)  # to the last digit, so that rest is rest
            self._is_resting = True
            return self._target
        self._now = self._to_come.pop()
        return self._now[0]

    def _planned(self) -> ruckig.Trajectory | None:
        """Have the way to the target found from where the axes are; None where ruckig finds none."""
        asked, path = self._asked, ruckig.Trajectory(self._n)
        asked.current_position, asked.current_velocity, asked.current_acceleration = self._now
        try:
            if self._otg.calculate(asked, path) is not ruckig.Result.Working:
                return None
        except ruckig.RuckigError:
            return None
        self._path, self._to_come = path, []
        self._time_s, self._duration_s, self._n_ahead = 0.0, path.duration, 1
        return path

    def _look_along(self, path: ruckig.Trajectory) -> None:
        """Look up where the axes will be in the ticks to come: one after a new target, then several at a time."""
        time_s, to_come = self._time_s, self._to_come
        for _ in range(self._n_ahead):
            time_s += self._tick_s
            to_come.append(path.at_time(time_s))
        to_come.reverse()
        self._n_ahead = N_AHEAD

    def _bounded(self) -> ruckig.InputParameter:
        bounded = ruckig.InputParameter(self._n)
        bounded.synchronization = ruckig.Synchronization.Phase
        bounded.max_velocity = [self._share * most for most in self._speed]
        bounded.max_acceleration, bounded.max_jerk = self._acceleration, self._jerk
        return bounded

    def _brake_by_hand(self) -> list[float]:
        """Stop within bounds where ruckig has no answer: every axis loses speed at its acceleration limit."""
        self.is_failed = True
        dt = self._tick_s
        at, speed = [*self._now[0]], [*self._now[1]]
        for i in range(self._n):
            loss = self._acceleration[i] * dt
            speed[i] -= min(max(speed[i], -loss), loss)
            at[i] += speed[i] * dt
        self._put(at, speed, self._rest)
        if not any(speed):
            self._target = self._asked.target_position = at
        return at

    def _put(self, at: list[float], speed: list[float], acceleration: list[float]) -> None:
        self._now: State = at, speed, acceleration
        self._path: ruckig.Trajectory | None = None
        """The way to the target, once it is found."""
        self._to_come: list[State] = []
        """Where the axes will be on it, tick by tick, the next one last."""
