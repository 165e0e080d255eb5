"""What a primary interface tells while an arm is in command: heard once, without waiting; nonsense and ends too."""

import socket
import struct
from contextlib import contextmanager

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.errors import WireError
from robot.hal.primary_watch import PrimaryWatch
from robot.hal.ur_primary import parse_key, parse_tool, split_packages
from sim_twin.controller.wire import ControllerVersion
from sim_twin.controller.wire.primary import pack_state
from sim_twin.controller.wire.primary_messages import pack_key, pack_text
from sim_twin.controller.wire.primary_state import CartesianInfo, PrimaryState, RobotModeData
from tests.support.loopback import own_address

TOOL = (0.0, 0.0, 0.16, 0.0, 0.0, 0.0)


def state(tool=TOOL):
    cartesian = CartesianInfo(tcp_pose=(0.4, 0.0, 0.3, 0.0, 3.1, 0.0), tcp_offset=tool)
    mode = RobotModeData(timestamp_us=7, is_power_on=True, robot_mode=7)
    return pack_state(PrimaryState(mode=mode, cartesian=cartesian), ControllerVersion(minor=11))


def started(name="other"):
    return pack_key(0, stamp_us=7, title="PROGRAM_XXX_STARTED", text=name)


class Ticks:
    def wait_tick(self):
        """What was sent is there already."""


OTHER_TOOL = (0.0, 0.0, 0.4, 0.0, 0.0, 0.0)


class Sending:
    """Sends, at the first tick, what is heard at those that follow."""

    def __init__(self, link, *sent):
        self._link, self._sent = link, b"".join(sent)

    def wait_tick(self):
        sent, self._sent = self._sent, b""
        self._link.sendall(sent)


@contextmanager
def listening(*before):
    """Yield a watch that has begun, and the controller's end of its link."""
    host = own_address()
    with socket.create_server((host, 0)) as server:
        watch = PrimaryWatch(host, tool=TOOL, port=server.getsockname()[1])
        begun = []

        class Accepting:
            def wait_tick(self):
                if not begun:
                    begun.append(server.accept()[0])
                    begun[0].sendall(b"".join((*before, state(), state())))

        watch.begin(Accepting())
        with begun[0] as link:
            watch.told.expect()
            watch.mind_tool(Sending(link, started("rtde_control"), state(OTHER_TOOL), state()))
            yield watch, link
        watch.close()


def heard(watch):
    """Look until something has come, a second at most."""
    for _ in range(1000):
        said = watch.look()
        if said is not None:
            return said
    return None


def test_what_was_started_before_is_not_heard_and_nothing_is_told_of_a_controller_that_goes_on():
    with listening(started("ours")) as (watch, link):
        link.sendall(state() + pack_text("hello", stamp_us=8) + state())
        assert heard(watch) is None


@pytest.mark.parametrize(
    ("sent", "is_foreign", "word"),
    [
        (started("palletise"), True, "'palletise'"),
        (state((0.0, 0.0, 0.1602, 0.0, 0.0, 0.0)), False, "tool centre point"),
        (state((0.0, 0.0, 0.16, 0.0, 0.0002, 0.0)), False, "tool centre point"),
        (state((0.0, 0.0, 0.2, 0.0, 0.0, 0.0)) + started(), True, "'other'"),
        (struct.pack(">IB", 3, 16), False, "hung up"),
        (struct.pack(">IB", 1 << 20, 16), False, "hung up"),
    ],
)
def test_what_changes_is_told_and_whose_the_program_is(sent, is_foreign, word):
    with listening() as (watch, link):
        link.sendall(sent)
        was_foreign, said = heard(watch)
        assert was_foreign is is_foreign
        assert word in said


def test_a_tool_within_a_tenth_of_a_millimetre_is_the_tool():
    with listening() as (watch, link):
        link.sendall(state((0.00009, 0.0, 0.16009, 0.0, 0.0, 0.0)))
        assert heard(watch) is None


def test_one_that_hangs_up_is_told_and_so_is_one_that_nobody_listens_to():
    with listening() as (watch, link):
        link.close()
        assert "hung up" in heard(watch)[1]
    assert "hung up" in watch.look()[1]


def test_where_nobody_answers_it_says_so_at_once():
    with pytest.raises(WireError, match="expected an answer at"):
        PrimaryWatch(own_address(), tool=TOOL).begin(Ticks())


@given(st.lists(st.integers(0, 60), min_size=1, max_size=6))
def test_packages_come_out_whole_however_the_stream_is_cut(cuts):
    sent = [state(), started(), pack_text("x", stamp_us=1), state()]
    stream, found, rest, at = b"".join(sent), [], b"", 0
    for cut in [*cuts, len(stream)]:
        packages, rest = split_packages(rest + stream[at : at + cut])
        found, at = found + packages, at + cut
    assert (found, rest) == (sent, b"")


@given(st.binary(max_size=200))
def test_nonsense_is_no_message_and_no_other_error(junk):
    for package in (junk, state()[: len(junk)], started()[: len(junk)], struct.pack(">IB", 5 + len(junk), 20) + junk):
        key, tool = parse_key(package), parse_tool(package)
        assert key is None or isinstance(key.title, str)
        assert tool is None or len(tool) == 6
