import numpy as np
import pytest
import ruckig

from config.loader import load_arm
from robot.chain import ToolChain
from robot.motion.commands import Commands
from robot.motion.follower import Follower
from robot.motion.limiter import AxisLimits, Limiter
from tests.support.profiles import envelope

ARM = load_arm("ur5e")
CHAIN = ToolChain(ARM)
LIMITS = AxisLimits(speed=(1.0, 2.0), acceleration=(5.0, 8.0), jerk=(100.0, 200.0))


def pair(tick_s):
    """Return two followers, of which the second asks for every part of a step by itself."""
    whole, parted = (Follower(ARM, envelope=envelope(tick_s), tick_s=tick_s, guard_z_m=0.12) for _ in range(2))
    parted._reach = None
    return whole, parted


@pytest.mark.parametrize("tick_s", [0.01, 0.002])
def test_a_step_in_one_call_is_the_step_made_of_its_parts_bit_for_bit(tick_s):
    """Targets all over the table and beyond its fences, pushes, brakes: whatever may hold a step back."""
    rng, (whole, parted) = np.random.default_rng(3), pair(tick_s)
    low, high = (np.array(corner) for corner in ARM.motion.workspace_m)
    n_held, x, at_m = 0, 0.0, np.array(whole.target_m)
    for k in range(120):
        at_m = np.clip(at_m + rng.normal(scale=0.04, size=3), low - 0.02, high + 0.02)
        yaw, x = x, rng.normal(scale=0.1)
        push = tuple(q + d for q, d in zip(whole.q_rad, rng.normal(scale=2e-4, size=6).tolist(), strict=True))
        for follower in (whole, parted):
            assert follower.aim(tuple(at_m.tolist()), ARM.tool_yaw_rad + yaw)
            if k % 20 == 13:
                follower.give_way(push)
            if k % 20 == 17:
                follower.brake()
        for _ in range(round(0.12 / tick_s)):
            assert whole.step() == parted.step()
            assert (whole.held, whole.trouble) == (parted.held, parted.trouble)
            n_held += whole.held is not None
    assert n_held > 10


def test_a_way_looked_up_ahead_is_the_way_that_ruckig_steps_along_bit_for_bit():
    """The limiter looks places up some ticks at a time; ruckig's own update is one tick at a time."""
    rng, dt = np.random.default_rng(0), 0.002
    limiter, otg = Limiter(LIMITS, tick_s=dt), ruckig.Ruckig(2, dt)
    asked, came = ruckig.InputParameter(2), ruckig.OutputParameter(2)
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = LIMITS.speed, LIMITS.acceleration, LIMITS.jerk
    asked.synchronization = ruckig.Synchronization.Phase
    for _ in range(100):
        target = rng.uniform(-0.3, 0.3, 2).tolist()
        limiter.aim(target)
        asked.target_position = target
        for _ in range(int(rng.integers(1, 30))):
            assert otg.update(asked, came) == ruckig.Result.Working
            came.pass_to_input(asked)
            assert limiter.step() == list(came.new_position)
            assert limiter.speed == list(came.new_velocity)
            assert limiter.acceleration == list(came.new_acceleration)


def test_commands_are_remembered_in_their_order_and_the_oldest_make_room():
    commands = Commands(5)
    joints = [tuple(q + 0.01 * k for q in ARM.home_rad) for k in range(9)]
    places = [CHAIN.points(q) for q in joints]
    commands.seed(joints[0], places[0])
    assert commands.past == (places[0][0],) * 2
    for q, place in zip(joints[1:], places[1:], strict=True):
        commands.add(q, place)
    assert commands.place == places[8]
    assert commands.tcp_m == places[8][0][0]
    assert commands.points_before == places[7][0]
    assert commands.past == (places[4][0], places[5][0])
    commands.seed(joints[2], places[2])
    assert (commands.place, commands.points_before, *commands.past) == (places[2], *(places[2][0],) * 3)


def test_what_is_not_a_number_is_never_written_down_as_a_command():
    follower = pair(0.01)[0]
    follower._tool.step = lambda: [float("nan"), *follower._tool.at[1:]]
    q = follower.step()
    assert follower.trouble == "unreachable"
    assert np.isfinite(follower._commands.rows).all()
    assert np.isfinite(q).all()
