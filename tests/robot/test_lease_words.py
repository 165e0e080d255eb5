"""What leases and tenures say when they refuse, whole; and how long they live."""

import pytest

from config.rig import PlantExpected
from robot.errors import SafetyError
from robot.messages import PlantIdentity, PlantKind, StationMode
from robot.safety import Arming, Grant, LeaseBook, Tenure
from tests.support.words import HostTime, says

FAKE = PlantIdentity(kind=PlantKind.FAKE, model="ur5e", serial="fake")
LIFE_NS = 1_000_000_000


def test_a_lease_says_who_has_it_and_what_became_of_it():
    host = HostTime()
    book = LeaseBook(now_ns=host)
    with pytest.raises(SafetyError, match=says("a lease: expected the name of its source, came none")):
        book.take("")
    lease = book.take("teleop", life_ns=LIFE_NS)
    assert (lease.number, lease.life_ns) == (1, LIFE_NS)
    message = "a lease for learner: teleop has it; it must be handed over or let go of first"
    with pytest.raises(SafetyError, match=says(message)):
        book.take("learner")
    message = "a hand-over: expected the name of the source that takes over, came none"
    with pytest.raises(SafetyError, match=says(message)):
        book.hand_over(lease, "")
    host.now_ns += LIFE_NS + 1
    message = "the lease 1 of teleop has expired: nothing was heard in its time"
    with pytest.raises(SafetyError, match=says(message)):
        book.renew(lease)
    book.revive(lease)
    other = book.hand_over(lease, "learner", life_ns=2 * LIFE_NS)
    assert (other.source, other.number, other.life_ns) == ("learner", 2, 2 * LIFE_NS)
    with pytest.raises(SafetyError, match=says("the lease 1 of teleop has ended; learner has it now")):
        book.revive(lease)
    book.release(other)
    with pytest.raises(SafetyError, match=says("the lease 2 of learner has ended; nobody has it now")):
        book.renew(other)


@pytest.mark.parametrize("how", ["renew", "revive", "hand over", "take"])
def test_a_lease_lives_anew_from_the_moment_it_was_renewed(how):
    host = HostTime()
    book = LeaseBook(now_ns=host)
    lease = book.take("a", life_ns=LIFE_NS)
    host.now_ns += LIFE_NS
    if how == "hand over":
        lease = book.hand_over(lease, "b", life_ns=LIFE_NS)
    elif how == "take":
        lease = book.take("a", life_ns=LIFE_NS)
    else:
        getattr(book, how)(lease)
    host.now_ns += LIFE_NS
    assert book.is_in_force(lease)
    host.now_ns += 1
    assert not book.is_in_force(lease)


def tenure(host):
    made = Arming(expected=PlantExpected(kind="fake", model="ur5e", serial="fake"), max_latches=9, latch_window=10)
    return made, Tenure(arming=made, profile="attended", now_ns=host)


def test_a_station_nobody_took_is_the_own_process_s_for_good():
    host = HostTime()
    _, held = tenure(host)
    assert held.grant is None
    assert held.renewed() == Grant(source="local", profile="attended", lease=1)
    host.now_ns += 10**18
    assert held.grant == Grant(source="local", profile="attended", lease=1)


def test_a_tenure_tells_once_that_motion_was_taken_away():
    host = HostTime()
    made, held = tenure(host)
    assert held.holds()
    held.take("teleop", life_ns=LIFE_NS)
    made.arm(identity=FAKE, by="tester", grant=held.renewed())
    made.engage()
    assert held.holds()
    host.now_ns += LIFE_NS + 1
    assert not held.holds()
    assert held.holds()
    assert made.state.mode is StationMode.DISARMED


def test_a_hand_over_gives_the_lease_with_the_life_that_was_asked_for():
    host = HostTime()
    _, held = tenure(host)
    message = "a hand-over: expected a source that has the lease, nobody has it"
    with pytest.raises(SafetyError, match=says(message)):
        held.hand_over("learner", life_ns=None)
    assert held.take("teleop", life_ns=LIFE_NS).life_ns == LIFE_NS
    lease = held.hand_over("learner", life_ns=3)
    assert (lease.source, lease.life_ns) == ("learner", 3)
    assert held.grant == Grant(source="learner", profile="attended", lease=2)
    host.now_ns += 4
    assert held.grant is None


def test_ending_a_tenure_disarms_and_frees_the_lease():
    made, held = tenure(HostTime())
    held.end()
    made.arm(identity=FAKE, by="tester", grant=held.renewed())
    held.end()
    assert (made.state.mode, made.state.reason) == (StationMode.DISARMED, "")
    assert held.grant is None
    assert held.renewed() == Grant(source="local", profile="attended", lease=2)
    assert held.take("local", life_ns=None).number == 3
