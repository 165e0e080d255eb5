"""Carries out probes on a station, one by one, and holds it while a person looks. State of one list."""

import math
from collections import deque
from collections.abc import Callable
from time import monotonic_ns, sleep

from robot.errors import NotEngagedError
from robot.hal.sight import Sight
from robot.messages import Hold, Intent, JointTarget, StationMode, Twist
from robot.teleop.driver import DrivenStation
from robot.teleop.probe_judge import Carried, Marks
from robot.teleop.probes import ASKED_M_S, STEP_S, TURN_RAD, Kind, Probe, asks_of, turned

__all__ = ["ProbeRun"]

STILL_RAD_S = 5e-3
LEAST_REST_S, MOST_REST_S = 0.4, 2.0
SILENT_S = 0.9
"""Longer than a stop may take, shorter than the lease lives."""
BACK_S, BACK_GAIN_S, THERE_M = 6.0, 0.3, 5e-4
"""The way back ends after so long or so near; nearer than the gain times the speed it goes slower."""


class ProbeRun:
    """One list on one station that is engaged.

    Args:
        station: what is moved, by intents alone.
        sights: where somebody else puts what is seen of the arm, as it comes.
        now_ns: the host's monotonic time, by which sights are stamped.
        pause: lets some seconds pass in which nobody asks for anything.

    Attributes:
        refusal: Why a step was refused, after which nothing moves any more; empty before.
    """

    def __init__(
        self,
        *,
        station: DrivenStation,
        sights: deque[Sight],
        now_ns: Callable[[], int] = monotonic_ns,
        pause: Callable[[float], object] = sleep,
    ) -> None:
        self._station, self._sights = station, sights
        self._now_ns, self._pause = now_ns, pause
        self._start_m = station.measured.tcp_position_m
        self.refusal = ""
        self._limiters: set[str] = set()

    def hold(self) -> None:
        """Hold the arm for one step, while somebody thinks."""
        self._step(Hold())

    def run(self, probe: Probe) -> Carried:
        """Carry one probe out. Nothing is reckoned meanwhile: an arm that is not asked anything for 200 ms latches."""
        self._sights.clear()
        self._limiters.clear()
        begun_ns = last_ns = self._now_ns()
        q_rad = self._station.measured.q_rad
        for ask in asks_of(probe, q_rad):
            last_ns = self._now_ns()
            self._step(ask)
        released_ns = self._now_ns()
        if probe.kind is Kind.SILENCE:
            self._pause(SILENT_S)
        else:
            self._rest()
        rested_ns, limiters = self._now_ns(), tuple(sorted(self._limiters))
        if probe.kind is Kind.SILENCE:
            self._step(Hold())
        elif probe.kind is Kind.TURN:
            self._turn_back(len(asks_of(probe, q_rad)))
        else:
            self._go_back()
        marks = Marks(
            begun_ns=begun_ns, last_asked_ns=last_ns, released_ns=released_ns, rested_ns=rested_ns,
            ended_ns=self._now_ns(), start_m=self._start_m, limiters=limiters, refusal=self.refusal,
            is_latched=self._station.state.mode is StationMode.LATCHED,
        )  # fmt: skip
        return Carried(probe=probe, marks=marks, sights=tuple(self._sights))

    def _step(self, intent: Intent) -> None:
        """Carry out one step; after a refusal there is none any more."""
        if self.refusal:
            return
        try:
            result = self._station.step(intent, duration_s=STEP_S)
        except NotEngagedError as error:
            self.refusal = str(error)
            return
        self._limiters.update(result.executed.limiters)
        state = self._station.state
        if result.verdicts or state.mode is not StationMode.ENGAGED:
            self.refusal = state.reason or result.verdicts[0].detail

    def _rest(self) -> None:
        """Hold until nothing moves."""
        for k in range(round(MOST_REST_S / STEP_S)):
            self._step(Hold())
            is_still = max(map(abs, self._station.measured.qd_rad_s)) < STILL_RAD_S
            if self.refusal or (is_still and k * STEP_S >= LEAST_REST_S):
                return

    def _go_back(self) -> None:
        """Go straight to where the tool stood when the list began, slower the nearer, and rest there."""
        for _ in range(round(BACK_S / STEP_S)):
            at_m = self._station.measured.tcp_position_m
            away_m = math.dist(at_m, self._start_m)
            if away_m < THERE_M or self.refusal:
                break
            share = min(ASKED_M_S / away_m, 1.0 / BACK_GAIN_S)
            x, y, z = (share * (b - a) for a, b in zip(at_m, self._start_m, strict=True))
            self._step(Twist(linear_m_s=(x, y, z)))
        self._rest()

    def _turn_back(self, n_steps: int) -> None:
        q_rad = self._station.measured.q_rad
        for k in range(1, n_steps + 1):
            self._step(JointTarget(q_rad=turned(q_rad, -TURN_RAD * k / n_steps)))
        self._rest()
