"""Shaping: whoever drives at a limit comes to rest short of it and is never refused; away from it nothing is slower."""

import numpy as np
import pytest
from msgspec.structs import replace

from config.limited import limited
from config.limits import ArmPart, Fence, KeepOut, Plane, Workspace
from robot.chain import ToolChain
from robot.hal.fake import FakeArm
from robot.kinematics import Kinematics
from robot.messages import Hold, JointTarget, Twist
from robot.motion import Mover
from robot.motion.follower import Follower
from robot.safety import Gate, GateLimits
from tests.support.profiles import ARM, envelope, profile
from tests.support.stations import arm_state, command

DT, STEP_S = 0.01, 0.05
KINEMATICS = Kinematics(ARM)
START = KINEMATICS.solve((0.42, 0.0, 0.2), ARM.home_rad)
WIDE_OPEN = replace(ARM, motion=replace(ARM.motion, workspace_m=((-3.0, -3.0, -3.0), (3.0, 3.0, 3.0))))
ROOM = Fence(name="room", low_m=(0.2, -0.5, 0.0), high_m=(0.7, 0.5, 0.6))
BALL = KeepOut(name="ball", low_m=(0.5, 0.0, 0.2), high_m=(0.5, 0.0, 0.2), radius_m=0.05)
SLANTED = Plane(name="slanted", point_m=(0.5, 0.0, 0.2), normal=(-1.0, 0.3, 0.2))
ELBOW_WALL = Plane(name="elbow_wall", point_m=(0.07, 0.0, 0.0), normal=(-1.0, 0.0, 0.0), parts=(ArmPart.ELBOW,))
NEAR_BOX = Fence(name="near", low_m=(0.3, -0.1, 0.1), high_m=(0.5, 0.1, 0.6), parts=(ArmPart.TCP, ArmPart.FLANGE))
LOW_BOX = replace(NEAR_BOX, high_m=(0.5, 0.1, 0.45))


class Driven:
    """Motion and gate on an arm that is always where it is told; everything is refused loudly."""

    def __init__(self, arm=ARM, q=START, dt=DT, name="unattended", **changes):
        self.held = profile(name, **changes)
        self.arm = limited(arm, self.held)
        self.envelope = envelope(dt, name, **changes)
        self.chain = ToolChain(ARM)
        self.mover = Mover(self.arm, envelope=self.envelope, table_m=0.0, tick_s=dt)
        spec = FakeArm(arm=arm, tick_s=dt).spec
        limits = GateLimits.of(self.arm, spec, table_m=0.0, tick_s=dt)
        self.gate = Gate(arm=self, limits=limits, envelope=self.envelope, chain=self.chain)
        self.dt, self.n, self.path, self.names = dt, 0, [q], {}
        self.mover.seed(arm_state(q))
        self.gate.seed(arm_state(q))

    def write(self, sent):
        self.path.append(sent.q_rad)

    def stop(self):
        return True

    def state(self):
        q = self.path[-1]
        measured = arm_state(q, stamp_ns=self.n * round(self.dt * 1e9))
        return replace(measured, tcp_position_m=self.chain.tcp(q))

    def drive(self, intent, seconds):
        for _ in range(round(seconds / STEP_S)):
            now_ns = self.n * round(self.dt * 1e9)
            assert self.gate.admit(intent, now_ns=now_ns) is None
            self.mover.begin_step(intent, self.state(), duration_s=STEP_S)
            for _ in range(round(STEP_S / self.dt)):
                now_ns, state = self.n * round(self.dt * 1e9), self.state()
                sent = command(self.mover.tick(state), sequence=self.gate.next_sequence, stamp_ns=now_ns)
                assert self.gate.write(sent, state, now_ns=now_ns) is None
                self.n += 1
            for limit in self.mover.limited:
                self.names[limit.name] = max(self.names.get(limit.name, 0.0), limit.amount)

    def gaps(self, name):
        fences = [fence for fence in self.envelope.fences if fence.name == name]
        return [min(f.gap(self.chain.points(q)[0][f.part]) for f in fences) for q in self.path]

    def speeds(self, part=0):
        points = [self.chain.points(q)[0][part] for q in self.path]
        return np.linalg.norm(np.diff(points, axis=0), axis=1) / self.dt


@pytest.mark.parametrize("dt", [0.002, 0.01])
@pytest.mark.parametrize(
    ("fence", "way"),
    [
        ({"planes": (SLANTED,)}, (0.5, 0.0, 0.0)),
        ({"planes": (SLANTED,)}, (0.4, -0.1, 0.0)),
        ({"boxes": (NEAR_BOX,)}, (0.3, 0.3, 0.0)),
        ({"boxes": (LOW_BOX,)}, (0.0, 0.0, 0.4)),
        ({"keep_outs": (BALL,)}, (0.5, 0.0, 0.0)),
    ],
)
def test_driven_straight_at_a_fence_the_tool_stops_at_it_and_not_a_hand_before(fence, way, dt):
    fence = {**fence, "boxes": (ROOM, *fence.get("boxes", ()))}
    driven = Driven(dt=dt, workspace=Workspace(**fence))
    name = next(thing.name for things in fence.values() for thing in things if thing.name != "room")
    driven.drive(Twist(linear_m_s=way), 2.0)
    gaps = driven.gaps(name)
    assert 0.0 < min(gaps) < 0.002
    assert name in driven.names or "workspace" in driven.names
    driven.drive(Hold(), 0.3)
    n, points = len(driven.path), driven.chain.points(driven.path[-1])[0]
    gap_of = min((f for f in driven.envelope.fences if f.name == name), key=lambda f: f.gap(points[f.part]))
    away = tuple(0.4 * v for v in gap_of.away(points[gap_of.part]))
    driven.drive(Twist(linear_m_s=away), 0.5)
    free = Driven(q=driven.path[n - 1], dt=dt, workspace=Workspace())
    free.drive(Twist(linear_m_s=away), 0.5)
    assert driven.speeds()[n:].max() >= 0.9 * free.speeds().max()


def test_the_tool_is_led_around_a_volume_that_lies_in_its_way():
    driven = Driven(workspace=Workspace(keep_outs=(replace(BALL, low_m=(0.5, 0.01, 0.2), high_m=(0.5, 0.01, 0.2)),)))
    driven.drive(Twist(linear_m_s=(0.3, 0.0, 0.0)), 3.0)
    x, _, _ = driven.chain.tcp(driven.path[-1])
    assert x > 0.6
    assert min(driven.gaps("ball")) > 0.0
    assert driven.names["ball"] > 0.0


def test_an_elbow_is_stopped_at_its_plane_although_the_tool_could_go_on():
    driven = Driven(workspace=Workspace(planes=(ELBOW_WALL,)))
    driven.drive(Twist(linear_m_s=(0.3, 0.0, 0.0)), 2.0)
    assert 0.0 < min(driven.gaps("elbow_wall")) < 0.005
    assert "elbow_wall" in driven.names


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("side", [-1, 1])
def test_a_joint_target_at_the_end_of_its_range_is_reached_slowly_and_never_refused(joint, side):
    low, high = ARM.joints[joint].range_rad
    end = high if side > 0 else low
    q = tuple(end - side * 0.3 if k == joint else v for k, v in enumerate(START))
    driven = Driven(arm=WIDE_OPEN, q=q, workspace=Workspace())
    driven.gate._limits = replace(driven.gate.limits, tip_min_m=-9.0, workspace_m=((-9.0,) * 3, (9.0,) * 3))
    driven.mover._limits = replace(driven.mover._limits, tip_min_m=-9.0, workspace_m=((-9.0,) * 3, (9.0,) * 3))
    driven.mover._follower = Follower(driven.arm, envelope=driven.envelope, tick_s=DT)
    driven.mover.seed(arm_state(q))
    target = tuple(end if k == joint else v for k, v in enumerate(q))
    driven.drive(JointTarget(q_rad=target), 6.0)
    path = np.array(driven.path)[:, joint]
    assert abs(path[-1] - end) < 2e-3
    speed = np.abs(np.diff(path)) / DT
    margin = driven.envelope.joints[joint].margin_rad
    assert speed[np.abs(path[1:] - end) < 0.1 * margin].max() <= 0.2 * ARM.joints[joint].speed_rad_s


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["attended", "unattended"])
def test_an_honest_random_driver_is_never_refused(seed, name):
    rng = np.random.default_rng(seed)
    driven = Driven(name=name)
    most = 0.0
    for _ in range(60):
        if rng.random() < 0.5:
            x, y, z = rng.uniform(-0.6, 0.6, 3)
            driven.drive(Twist(linear_m_s=(x, y, z), angular_rad_s=(0.0, 0.0, rng.uniform(-1.0, 1.0))), 0.25)
        elif rng.random() < 0.5:
            target = np.array(driven.path[-1]) + rng.normal(0.0, 0.5, 6)
            driven.drive(JointTarget(q_rad=tuple(target.tolist())), 0.25)
        else:
            driven.drive(Hold(), 0.15)
    for part, speed in enumerate(driven.envelope.part_step_m):
        most = max(most, driven.speeds(part).max() / (speed / DT))
    assert most <= 1.0
