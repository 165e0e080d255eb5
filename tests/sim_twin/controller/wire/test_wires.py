"""All ports in one hand."""

import pytest

from sim_twin.controller.wire import ControllerVersion, Wires
from tests.support.wire_doubles import HOST, Robot

pytestmark = pytest.mark.realtime

NUMBERS = {29999, 30001, 30002, 30003, 30004, 30011, 30012, 30013, 63352}


def wires_of(robot, *, gripper=True):
    return Wires(
        outputs=robot.outputs,
        inputs=robot,
        dashboard=robot,
        states=robot,
        scripts=robot,
        gripper=robot if gripper else None,
        version=robot.version,
        stamp_us=lambda: 0,
    )


def test_every_port_of_a_controller_is_open(bench):
    assert set(bench.wires.port_by_number) == NUMBERS
    clients = [bench.client(number) for number in NUMBERS]
    clients[0].until(lambda: bench.wires.n_peers == len(NUMBERS))


def test_without_a_gripper_its_port_stays_shut():
    with wires_of(Robot(ControllerVersion()), gripper=False) as wires:
        wires.open(HOST, is_free=True)
        assert set(wires.port_by_number) == NUMBERS - {63352}


def test_a_port_that_is_taken_leaves_nothing_open():
    robot = Robot(ControllerVersion())
    host = "127.0.3.7"
    with wires_of(robot) as first:
        first.open(host)
        with wires_of(robot) as second, pytest.raises(OSError, match=rf"{host}:29999.*choose another loopback address"):
            second.open(host)
        assert first.n_peers == 0
    with wires_of(robot) as again:
        again.open(host)
        assert {port.number for port in again.port_by_number.values()} == NUMBERS


def test_a_frozen_controller_holds_its_connections_and_then_goes_on(bench):
    client = bench.rtde()
    client.outputs("timestamp")
    client.rtde("S")
    for port in bench.wires.port_by_number.values():
        port.is_frozen = True
    for step in range(100):
        bench.wires.poll()
        bench.wires.tick(step)
    assert client.silent()
    for port in bench.wires.port_by_number.values():
        port.is_frozen = False
    bench.wires.tick(101)
    assert client.frame()[0] == "U"


def test_a_lost_link_releases_the_inputs(bench):
    client = bench.rtde()
    client.inputs("input_int_register_0")
    bench.port(30004).drop_peers()
    assert client.ended()
    assert bench.rtde().inputs("input_int_register_0") == b"\x01INT32"
