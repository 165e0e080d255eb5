"""The virtual robot's gripper: activation, places, what is held, power."""

import pytest

from sim_twin.controller.states import Event
from sim_twin.controller.wire import GripperRequest
from sim_twin.names import on_table
from tests.support.virtual_robot import make_robot, run


def settle(robot, n=3000):
    run(robot, 5)
    run(robot, n, lambda: robot.hand.measure().obj != 0 and robot.hand.measure().sta != 1)


def test_a_hand_that_was_not_activated_stays_and_says_so():
    robot = make_robot()
    before = robot.hand.opening_m
    robot.hand.request(GripperRequest(gto=1, pos=255))
    run(robot, 100)
    assert robot.hand.opening_m == pytest.approx(before, abs=1e-3)
    assert robot.hand.measure().flt == 7


def test_activation_strokes_open_and_shut():
    robot = make_robot()
    assert robot.hand.measure().sta == 0
    seen = []
    robot.hand.request(GripperRequest(act=1))
    for _ in range(2000):
        robot.step()
        seen.append(robot.hand.measure().pos)
        if robot.hand.measure().sta == 3:
            break
    assert robot.hand.measure().sta == 3
    assert min(seen) <= 3
    assert max(seen) >= 250


@pytest.mark.parametrize("pos", [0, 100, 255])
def test_the_fingers_go_where_they_are_asked(pos):
    robot = make_robot()
    robot.hand.request(GripperRequest(act=1))
    settle(robot)
    robot.hand.request(GripperRequest(act=1, gto=1, pos=pos, spe=255, force=100))
    settle(robot)
    measured = robot.hand.measure()
    assert abs(measured.pos - pos) <= 4
    assert measured.obj == 3
    assert measured.pre == pos


def test_what_is_between_the_fingers_is_told():
    robot = make_robot()
    world = robot.machine.world
    robot.hand.request(GripperRequest(act=1))
    settle(robot)
    robot.hand.request(GripperRequest(act=1, gto=1, pos=0, spe=255, force=0))
    settle(robot)
    address = int(world.model.joint(on_table(world.scenario.cylinders[0].name)).qposadr[0])
    robot.hand.request(GripperRequest(act=1, gto=1, pos=255, spe=255, force=0))
    seen = []
    for _ in range(1000):
        # Held up by hand until the fingers have it.
        world.data.qpos[address : address + 3] = world.data.site("tcp").xpos
        robot.step()
        seen.append(robot.hand.measure().obj)
    assert seen[:3] == [0, 0, 0]
    assert seen[-1] == 2
    assert 20 < robot.hand.measure().pos < 240
    robot.hand.request(GripperRequest(act=1, gto=1, pos=0, spe=255, force=0))
    settle(robot)
    assert robot.hand.measure().obj == 3


def test_a_protective_stop_does_not_touch_the_hand():
    robot = make_robot()
    robot.hand.request(GripperRequest(act=1))
    settle(robot)
    robot.programs.handle(Event.PROTECTIVE_STOP)
    robot.hand.request(GripperRequest(act=1, gto=1, pos=128, spe=255, force=0))
    settle(robot)
    assert abs(robot.hand.measure().pos - 128) <= 4


def test_a_hand_without_power_is_dead_and_comes_back_reset():
    robot = make_robot()
    robot.hand.request(GripperRequest(act=1, gto=1, spe=255))
    settle(robot)
    robot.hand.request(GripperRequest(act=1, gto=1, pos=255, spe=255))
    run(robot, 60)
    robot.panel.power_off()
    run(robot, 20)
    standing_m = robot.hand.opening_m
    assert 0.02 < standing_m < 0.08
    robot.hand.request(GripperRequest(act=1, gto=1, pos=255, spe=255))
    run(robot, 300)
    assert robot.hand.opening_m == pytest.approx(standing_m, abs=2e-3)
    robot.panel.brake_release()
    run(robot, 2000, lambda: robot.hand.measure().is_powered)
    assert (robot.hand.measure().sta, robot.hand.requested) == (0, GripperRequest())


def test_an_activation_that_is_taken_back_stands_where_it_is():
    robot = make_robot()
    robot.hand.request(GripperRequest(act=1))
    run(robot, 5000, lambda: robot.hand.opening_m < 0.06)
    robot.hand.request(GripperRequest(act=0))
    run(robot, 20)
    standing_m = robot.hand.opening_m
    run(robot, 300)
    assert robot.hand.measure().sta == 0
    assert robot.hand.opening_m == pytest.approx(standing_m, abs=1e-3)


def test_fingers_that_are_told_to_go_no_further_stand():
    robot = make_robot()
    robot.hand.request(GripperRequest(act=1))
    settle(robot)
    robot.hand.request(GripperRequest(act=1, gto=1, pos=0, spe=255))
    run(robot, 1000, lambda: robot.hand.opening_m > 0.05)
    robot.hand.request(GripperRequest(act=1, gto=0, pos=0, spe=255))
    run(robot, 20)
    standing_m = robot.hand.opening_m
    run(robot, 300)
    assert standing_m < 0.075
    assert robot.hand.opening_m == pytest.approx(standing_m, abs=1e-3)


def laid_out(robot):
    robot.lay_out(seed=1, epoch=2, digital_out=0)
    world = robot.machine.world
    return world.model.actuator_forcerange.tobytes(), world.grip_speed_m_s, world.opening_goal_m


def test_a_reset_of_the_table_leaves_nothing_of_a_hard_grip_and_the_hand_active():
    robot = make_robot()
    robot.hand.request(GripperRequest(act=1))
    settle(robot)
    robot.hand.request(GripperRequest(act=1, gto=1, pos=255, spe=0, force=255))
    run(robot, 20)
    assert laid_out(robot) == laid_out(make_robot())
    assert robot.hand.measure().sta == 3


def test_a_reset_of_the_table_ends_an_activation_and_no_stroke_follows():
    robot = make_robot()
    robot.hand.request(GripperRequest(act=1))
    run(robot, 100)
    assert robot.hand.measure().sta == 1
    laid_out(robot)
    for _ in range(1000):
        assert robot.hand.measure().sta == 3
        assert robot.hand.opening_m > 0.083
        robot.step()


def test_a_reset_of_the_table_activates_no_hand():
    robot = make_robot()
    laid_out(robot)
    run(robot, 100)
    assert robot.hand.measure().sta == 0
