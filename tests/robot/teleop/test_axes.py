"""Sticks, pucks and their libraries, as far as they can be tried without them."""

import sys
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.messages import Grip
from robot.teleop.axes import DEAD_ZONE, Buttons, Switches, beyond_dead_zone
from robot.teleop.device import DEVICES, Frame, MissingExtraError, open_device

NONE = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("share", "out"), [(0.0, 0.0), (DEAD_ZONE, 0.0), (-DEAD_ZONE, 0.0), (1.0, 1.0), (-1.0, -1.0), (1.5, 1.0)]
)
def test_the_dead_zone_is_cut_out_and_full_is_full(share, out):
    assert beyond_dead_zone(share) == pytest.approx(out, abs=1e-12)


@given(st.floats(-1, 1), st.floats(0, 1e-3))
def test_a_stick_fades_in_without_a_jump_and_is_odd(share, more):
    assert beyond_dead_zone(-share) == -beyond_dead_zone(share)
    assert 0.0 <= beyond_dead_zone(min(1.0, share + more)) - beyond_dead_zone(share) <= 1.2e-3 + 1e-9


def test_what_is_not_finite_is_left_for_whoever_refuses_it():
    assert beyond_dead_zone(float("inf")) == float("inf")


def test_a_press_counts_once_however_long_it_lasts():
    switches = Switches()

    def say(**down):
        return switches.asked(Buttons(**down), stamp_ns=0, linear=NONE, angular=NONE)

    assert [say(frame=True).frame for _ in range(3)] == [Frame.TOOL] * 3
    assert say().frame is Frame.TOOL
    assert say(frame=True).frame is Frame.BASE
    assert [say(slower=True).speed_share for _ in range(3)] == [0.9] * 3
    assert say(close=True).grip is Grip.CLOSE
    assert say(open=True).grip is Grip.OPEN
    assert say(clutch=True, deadman=True).is_clutched
    assert not say(deadman=True).is_clutched


@pytest.mark.parametrize(("device", "library"), [("gamepad", "pygame"), ("spacemouse", "pyspacemouse")])
def test_a_missing_library_is_one_error_that_names_its_extra(monkeypatch, device, library):
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(MissingExtraError, match=rf"pip install 'autotelic\[{device}\]'"):
        open_device(device, now_ns=lambda: 0, step_s=0.02).connect()


class Puck:
    def __init__(self, states):
        self.states, self.is_closed = list(states), False

    def read(self):
        return self.states.pop(0) if len(self.states) > 1 else self.states[0]

    def close(self):
        self.is_closed = True


def puck_state(t, x=0.0, buttons=(0, 0)):
    return SimpleNamespace(t=t, x=x, y=0.0, z=0.0, roll=0.0, pitch=0.0, yaw=0.0, buttons=list(buttons))


def test_a_push_of_the_puck_is_held_and_one_of_which_nothing_new_is_heard_grows_old(monkeypatch):
    puck, time = Puck([puck_state(0.0)]), SimpleNamespace(now_ns=0)
    library = SimpleNamespace(open=lambda **_: puck, AxisConvention=SimpleNamespace(ROS="ros"))
    monkeypatch.setitem(sys.modules, "pyspacemouse", library)
    device = open_device("spacemouse", now_ns=lambda: time.now_ns, step_s=0.02)
    device.connect()
    time.now_ns = 10
    asked = device.read()
    assert (asked.is_held, asked.stamp_ns) == (False, 10)
    puck.states = [puck_state(0.1, x=0.5), puck_state(0.2, x=1.0, buttons=(1, 0))]
    asked = device.read()
    assert (asked.is_held, asked.stamp_ns, asked.linear, asked.grip) == (True, 10, (1.0, 0.0, 0.0), Grip.CLOSE)
    time.now_ns = 10**9
    assert device.read().stamp_ns == 10
    device.close()
    device.close()
    assert puck.is_closed


def test_a_puck_that_was_unplugged_ends_the_drive(monkeypatch):
    def gone():
        raise OSError("read failed")

    puck = SimpleNamespace(read=gone, close=lambda: None)
    library = SimpleNamespace(open=lambda **_: puck, AxisConvention=SimpleNamespace(ROS="ros"))
    monkeypatch.setitem(sys.modules, "pyspacemouse", library)
    device = open_device("spacemouse", now_ns=lambda: 0, step_s=0.02)
    device.connect()
    assert device.read().is_over


@pytest.mark.parametrize("name", DEVICES)
def test_every_device_says_what_its_keys_do(name, tmp_path):
    (tmp_path / "s.yaml").write_text("steps: [{for_s: 1.0}]")
    device = open_device(f"{name}:{tmp_path / 's.yaml'}" if name == "script" else name, now_ns=lambda: 0, step_s=0.02)
    assert all(key and what for key, what in device.keys)
