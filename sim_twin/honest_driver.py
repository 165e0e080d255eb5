"""An honest driver on the twin: reaches with and without shaping, and drives straight at one limit until at rest."""

import math

import msgspec
import numpy as np
from numpy.typing import NDArray

from config.limits import Profile
from config.resolved import Resolved
from robot.envelope import Envelope
from robot.kinematics import Kinematics
from robot.messages import ArmCommand, GripCommand, Intent, Twist, Vec3, Vec6
from robot.safety import Gate, GateLimits
from sim_twin.bench import open_twin
from sim_twin.plant import TwinPlant

__all__ = ["CAP_M_S", "Drive", "drive_at", "reaches_s", "towards"]

Array = NDArray[np.float64]
CAP_M_S = 0.25
"""Speed that neither way of reaching goes beyond."""
EASE_PER_S = 5.0
"""A driver slows down before a goal: no faster than so many of the distance left a second."""
THERE_M = 0.006
N_REACHES, MOST_STEPS = 10, 200
ANY = 1e9
HEIGHTS_M = (0.225, 0.2)
STILL_M = 2e-5
"""A tool that moves by less in a time step rests."""
LONGEST_DRIVE = 160
FREE_SEED = 12
"""A table on which nothing, no open lid either, is under where the tool begins."""
RESTING_STEPS = 6


def towards(at_m: Vec3, goal_m: Vec3) -> Vec3:
    """Return the velocity that the driver asks for: straight at the goal, at the cap until it is near."""
    far = math.dist(at_m, goal_m)
    speed = min(CAP_M_S, EASE_PER_S * far)
    x, y, z = (speed * (b - a) / far for a, b in zip(at_m, goal_m, strict=True))
    return x, y, z


def _goals() -> list[Vec3]:
    rng = np.random.default_rng(7)
    return [
        (float(rng.uniform(0.26, 0.62)), float(rng.uniform(-0.34, 0.34)), HEIGHTS_M[k % len(HEIGHTS_M)])
        for k in range(N_REACHES)
    ]


def reaches_s(resolved: Resolved, *, is_shaped: bool) -> list[float]:
    """Return how long each of ten reaches takes, through the whole stack or by inverse kinematics alone."""
    hand = _Shaped(resolved) if is_shaped else _Bare(resolved)
    taken: list[float] = []
    for goal in _goals():
        n = 0
        while math.dist(hand.at_m, goal) >= THERE_M:
            hand.step(towards(hand.at_m, goal))
            n += 1
            if n > MOST_STEPS:
                raise AssertionError(f"expected the tool at {goal} in {MOST_STEPS} time steps, it is at {hand.at_m}")
        taken.append(n * resolved.arm.motion.step_s)
    return taken


class _Shaped:
    """The twin through motion and gate."""

    def __init__(self, resolved: Resolved) -> None:
        self._station, _ = open_twin(resolved)
        self._percept = self._station.reset(seed=3, epoch=0)

    @property
    def at_m(self) -> Vec3:
        return self._percept.tcp_position_m

    def step(self, velocity_m_s: Vec3) -> None:
        came = self._station.step(Twist(linear_m_s=velocity_m_s))
        assert not came.verdicts, came.verdicts
        self._percept = came.percept


class _Bare:
    """The same twin, its joints commanded straight from a point that goes as the driver asks.

    Nothing shapes them; the gate passes them, its limits of speed, acceleration and jerk of the profile set aside.
    """

    def __init__(self, resolved: Resolved) -> None:
        self._plant = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
        self._arm, self._kinematics, tool = self._plant.arm, Kinematics(resolved.arm), resolved.arm.tool
        self._tick_s, self._n_ticks = resolved.rig.tick_s, round(resolved.arm.motion.step_s / resolved.rig.tick_s)
        self._grip = GripCommand(opening_m=tool.stroke_m, force_n=tool.grip_force_n, speed_m_s=tool.speed_m_s[1])
        self._arm.connect()
        self._gate = Gate(
            arm=self._arm,
            limits=GateLimits.of(
                resolved.arm, self._arm.spec, table_m=resolved.scenario.table.height_m, tick_s=self._tick_s
            ),
            envelope=Envelope.of(_any_rate(resolved.profile), resolved.arm, tick_s=self._tick_s),
            chain=self._kinematics.chain,
        )
        self._plant.resetter.reset(seed=3, epoch=0, digital_out=0)
        self._state = self._arm.read()
        self._gate.seed(self._state)
        self._q, self._asked = self._state.q_rad, np.array(self._state.tcp_position_m)

    @property
    def at_m(self) -> Vec3:
        return self._state.tcp_position_m

    def step(self, velocity_m_s: Vec3) -> None:
        now_ns = self._arm.clock.now_ns
        assert self._gate.admit(Twist(linear_m_s=velocity_m_s), now_ns=now_ns()) is None
        for _ in range(self._n_ticks):
            self._asked += np.array(velocity_m_s) * self._tick_s
            x, y, z = self._asked.tolist()
            self._q = self._kinematics.solve((x, y, z), self._q)
            command = ArmCommand(
                stamp_ns=now_ns(), sequence=self._gate.next_sequence, q_rad=self._q, grip=self._grip, digital_out=0
            )
            refused = self._gate.write(command, self._state, now_ns=now_ns())
            assert refused is None, refused
            self._arm.clock.wait_tick()
            self._state = self._arm.read()


def _any_rate(profile: Profile) -> Profile:
    rates = ("acceleration_rad_s2", "jerk_rad_s3", "stop_acceleration_rad_s2", "stop_jerk_rad_s3")
    joints = tuple(msgspec.structs.replace(j, **dict.fromkeys(rates, ANY)) for j in profile.joints)
    speeds = msgspec.structs.replace(profile.speeds, tcp_m_s=ANY, flange_m_s=ANY, elbow_m_s=ANY)
    return msgspec.structs.replace(profile, joints=joints, speeds=speeds)


class Drive(msgspec.Struct, frozen=True, kw_only=True):
    """Where a drive began and where the physics came to rest."""

    start_m: Vec3
    rest_m: Vec3
    start_rad: Vec6
    rest_rad: Vec6
    limiters: tuple[str, ...]
    """What acted in the last time step in which anything did."""
    refused: str = ""
    """Why the gate refused, empty where it did not: no honest driver should be."""


def drive_at(resolved: Resolved, intent: Intent) -> Drive:
    """Ask for one intent again and again until the arm has come to rest, and return where that is."""
    station, plant = open_twin(resolved)
    percept = station.reset(seed=FREE_SEED, epoch=0)
    start_m, start_rad = percept.tcp_position_m, _joints(plant)
    limiters: tuple[str, ...] = ()
    refused = ""
    n_still, before = 0, start_rad
    for _ in range(LONGEST_DRIVE):
        came = station.step(intent)
        if came.verdicts:
            refused = f"{came.verdicts[0].reason}: {came.verdicts[0].detail}"
            break
        limiters = came.executed.limiters or limiters
        now = _joints(plant)
        n_still = n_still + 1 if max(abs(a - b) for a, b in zip(now, before, strict=True)) < STILL_M else 0
        before = now
        if n_still >= RESTING_STEPS:
            break
    return Drive(
        start_m=start_m, rest_m=plant.arm.read().tcp_position_m, start_rad=start_rad, rest_rad=_joints(plant),
        limiters=limiters, refused=refused,
    )  # fmt: skip


def _joints(plant: TwinPlant) -> Vec6:
    a, b, c, d, e, f = plant.world.data.qpos[:6].tolist()
    return a, b, c, d, e, f
