"""A way in which the genuine ur_rtde client, bare, moves an arm that nobody asked to move: it does, here too.

The fault trials (`autotelic bench faults`) say that nothing moves under our backend after a stop. That could be so
because nothing here ever would; this shows that it would.
"""

import pytest

from tests.support.genuine_client import HOME, make_station, until
from tests.support.loopback import own_address

pytestmark = pytest.mark.realtime

pytest.importorskip("rtde_control", reason="the genuine client comes with `pip install autotelic[lab]`")

JOG_RAD = 0.3
FEWEST_HZ = 2.0
"""Of the watchdog, so that a busy machine does not bring it about."""
LOOKAHEAD_S, GAIN = 0.1, 300.0


class Bare:
    """The client's own calls, and the truth of the twin's first joint."""

    def __init__(self, station):
        self.control, self.process = station.control, station.process

    @property
    def q0_rad(self):
        return self.process.fault("truth")["q_rad"][0]

    def is_ended(self):
        return self.process.fault("truth")["runtime"] == "STOPPED"

    def is_near(self, q0_rad):
        return abs(self.q0_rad - q0_rad) < 0.01

    def servo(self, q, n=100):
        for _ in range(n):
            begun = self.control.initPeriod()
            self.control.servoJ(list(q), 0.0, 0.0, 0.002, LOOKAHEAD_S, GAIN)
            self.control.waitPeriod(begun)

    def starve(self):
        """Arm the watchdog, servo in place, and fall silent until the program has ended."""
        assert self.control.setWatchdog(FEWEST_HZ)
        self.servo(HOME)
        assert until(self.is_ended, 5.0)

    def jog(self):
        """Let somebody move the arm at the pendant, and return where the first joint stands then."""
        before = self.q0_rad
        self.process.fault("jog", rad=[JOG_RAD, 0, 0, 0, 0, 0])
        assert until(lambda: self.is_near(before + JOG_RAD) and self.is_ended(), 10.0)
        return self.q0_rad


@pytest.fixture
def opened():
    """A controller of its own: what a client was led to must lead no other test astray."""
    with make_station(own_address()) as station:
        yield station


@pytest.fixture
def bare(opened):
    opened.go(HOME)
    return Bare(opened)


def test_a_script_that_is_uploaded_again_servoes_to_the_target_from_before_the_stop(bare):
    """Facts 1.12, 9: the command register keeps its last value, and the script acts on it at once."""
    bare.starve()
    jogged = bare.jog()
    assert bare.control.reuploadScript()
    assert until(lambda: bare.is_near(jogged - JOG_RAD), 5.0), f"{bare.q0_rad - jogged:.4f} rad"
