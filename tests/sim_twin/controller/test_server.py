"""The virtual controller's process: its pace, its addresses, the version that it announces."""

import pytest

from sim_twin.controller.pacing import Pacer
from sim_twin.controller.server import ControllerServer, Setup, parse_version


def test_a_slept_through_slot_is_skipped_and_counted():
    now, slept = [0], []

    def sleep(seconds):
        slept.append(seconds)
        now[0] += round(seconds * 1e9)

    pacer = Pacer(period_ns=2_000_000, now_ns=lambda: now[0], sleep=sleep)
    pacer.wait()
    assert now[0] == 2_000_000
    now[0] += 9_000_000
    pacer.wait()
    assert pacer.n_missed == 3
    pacer.wait()
    assert now[0] == 12_000_000
    assert pacer.n_missed == 3


def test_only_loopback_is_listened_on_unless_asked():
    with pytest.raises(ValueError, match="loopback"):
        ControllerServer(Setup(host="10.1.2.3"))


@pytest.mark.parametrize("text", ["", "5", "a.b", "1.2.3.4.5", "5.-1", "10.9.0"])
def test_a_version_is_numbers(text):
    with pytest.raises(ValueError, match="version"):
        parse_version(text)
    assert str(parse_version("5.23.1")).startswith("5.23.1.")
