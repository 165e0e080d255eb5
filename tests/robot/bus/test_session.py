"""The bus on real sockets: who may write what, what comes across, links that break, rubbish, and whom to look for."""

import gc
import socket
import subprocess
import sys
import threading
import time
from queue import Empty, SimpleQueue

import msgspec
import pytest

from robot.bus import (
    CELL,
    RESET,
    TRUTH,
    Bus,
    BusConfigError,
    BusError,
    CellAction,
    CellTruth,
    ResetDone,
    ResetRequest,
    Role,
    SchemaError,
    Topic,
    link,
)
from robot.bus.errors import NoHubError
from robot.bus.outlet import Outlet
from robot.bus.topic import key_of
from robot.bus.watch import ping_all
from robot.messages import SceneState

pytestmark = pytest.mark.realtime

HOST, SERIAL = "127.0.0.100", "4711"
EMPTY = SceneState(stamp_ns=0, objects=())


class Picture(msgspec.Struct, frozen=True, kw_only=True):
    number: int
    pixels: bytes


PICTURE = Topic(name="test/picture", kind=Picture, writers=(Role.TWIN,), is_shared_memory=True)


def free_endpoint():
    with socket.create_server((HOST, 0)) as free:
        return f"tcp/{HOST}:{free.getsockname()[1]}"


@pytest.fixture
def endpoint():
    return free_endpoint()


@pytest.fixture
def hub(endpoint):
    with Bus(endpoint, serial=SERIAL, role=Role.TWIN, is_hub=True) as bus:
        yield bus


def join(endpoint, role=Role.LEARNING, **more):
    return Bus(endpoint, serial=SERIAL, role=role, **more)


def until(is_true, timeout_s=15.0):
    end = time.monotonic() + timeout_s
    while not is_true():
        assert time.monotonic() < end
        time.sleep(0.01)


def put_until(publisher, message, came):
    """Write until somebody reads: a declaration takes its time to cross."""
    end = time.monotonic() + 15.0
    while time.monotonic() < end:
        publisher.put(message)
        try:
            return came.get(timeout=0.05)
        except Empty:
            continue
    raise AssertionError("nothing came")


def test_what_the_hub_writes_comes_to_a_client_and_what_a_client_writes_to_another(hub, endpoint):
    with join(endpoint) as reader, join(endpoint, Role.TWIN, source="other") as writer:
        came = SimpleQueue()
        subscriber = reader.subscriber(TRUTH, came.put)
        assert put_until(hub.publisher(TRUTH), EMPTY, came).envelope.source == "twin"
        received = put_until(writer.publisher(TRUTH), EMPTY, came)
        while received.envelope.source != "other":
            received = came.get(timeout=5.0)
        assert received.message == EMPTY
        assert 0 <= received.age_ns < 5e9
        assert subscriber.counts.malformed == subscriber.counts.other_schema == 0


def test_a_picture_comes_whole_through_shared_memory(hub, endpoint):
    with join(endpoint) as reader:
        came = SimpleQueue()
        reader.subscriber(PICTURE, came.put)
        sent = Picture(number=3, pixels=bytes(range(256)) * 3600)
        assert put_until(hub.publisher(PICTURE), sent, came).message == sent
        assert put_until(hub.publisher(PICTURE), Picture(number=4, pixels=b""), came).message is not None


def test_a_picture_that_finds_no_room_in_shared_memory_comes_all_the_same(hub, endpoint, monkeypatch):
    monkeypatch.setattr("robot.bus.ports.POOL_BYTES", 4096)
    with join(endpoint) as reader:
        came = SimpleQueue()
        reader.subscriber(PICTURE, came.put)
        sent = Picture(number=3, pixels=bytes(100_000))
        assert put_until(hub.publisher(PICTURE), sent, came).message == sent


def test_what_is_another_role_s_to_write_ask_or_answer_is_refused(hub, endpoint):
    with join(endpoint, Role.VIEWER) as viewer:
        with pytest.raises(BusConfigError, match="twin/truth: expected to be written by twin, viewer is viewer"):
            viewer.publisher(TRUTH)
        with pytest.raises(BusConfigError, match="station/reset: expected to be answered by twin"):
            viewer.answerer(RESET)
        with pytest.raises(BusConfigError, match="station/reset: expected to be asked by robot or learning or teleop"):
            viewer.asker(RESET)


def answer_one(answerer, act):
    def run():
        until(lambda: (asked := answerer.next()) is not None and (act(asked) or True))

    thread = threading.Thread(target=run)
    thread.start()
    return thread


def test_a_question_is_answered_or_refused_in_words(hub, endpoint):
    with join(endpoint) as asker:
        request = ResetRequest(seed=1, epoch=2, digital_out=0)
        answerer = hub.answerer(RESET)
        thread = answer_one(answerer, lambda asked: asked.answer(ResetDone(seed=asked.request.seed, epoch=2)))
        assert asker.asker(RESET).ask(request) == ResetDone(seed=1, epoch=2)
        thread.join()
        thread = answer_one(answerer, lambda asked: asked.refuse("the table is taken"))
        with pytest.raises(BusError, match="station/reset: the table is taken"):
            asker.asker(RESET).ask(request)
        thread.join()


def test_a_question_that_nobody_answers_says_whom_to_look_for(hub, endpoint):
    with join(endpoint, Role.ROBOT) as asker:
        with pytest.raises(BusError, match="twin/cell: expected an answer within 5 s, none came"):
            asker.asker(CELL).ask(CellAction())
        hub.close()
        until(lambda: not asker.is_linked)
        with pytest.raises(BusError, match="twin/cell: expected a link to the bus's hub, it is down"):
            asker.asker(CELL).ask(CellAction())


def test_every_process_answers_a_ping(hub, endpoint):
    with join(endpoint), join(endpoint, Role.VIEWER) as viewer:
        until(lambda: len(ping_all(viewer)) == 2)
        answers = ping_all(viewer)
    assert [(answer.source, answer.role) for answer in answers] == [("learning", "learning"), ("twin", "twin")]
    assert all(answer.is_same_clock and 0 < answer.round_trip_ms < 5e3 for answer in answers)


def test_a_link_that_broke_is_made_again_and_everything_goes_on_over_it(endpoint):
    hub = Bus(endpoint, serial=SERIAL, role=Role.TWIN, is_hub=True)
    hub.open()
    with join(endpoint) as reader:
        came = SimpleQueue()
        subscriber = reader.subscriber(TRUTH, came.put)
        put_until(hub.publisher(TRUTH), EMPTY, came)
        assert reader.is_linked
        hub.close()
        until(lambda: not reader.is_linked)
        with Bus(endpoint, serial=SERIAL, role=Role.TWIN, is_hub=True) as other:
            until(lambda: reader.is_linked)
            put_until(other.publisher(TRUTH), EMPTY, came)
            assert subscriber.counts.restarts == 1


def test_rubbish_and_other_versions_on_a_topic_are_counted_and_end_nothing(hub, endpoint):
    with join(endpoint) as reader:
        came = SimpleQueue()
        subscriber = reader.subscriber(TRUTH, came.put)
        publisher = hub.publisher(TRUTH)
        put_until(publisher, EMPTY, came)
        key = key_of(SERIAL, TRUTH.name)
        other = Outlet(CellTruth, source="old_twin", clock=0, now_ns=time.monotonic_ns).wrap(
            CellTruth(lamps={}, lids={})
        )
        for payload, attachment in ((b"\xff", None), (b"", b"AT"), (b"{}", b"\0" * 56)):
            hub.raw().put(key, payload, attachment=attachment)
        hub.raw().put(key, other.payload, attachment=other.attachment)
        hub.raw().delete(key)
        until(lambda: subscriber.counts.malformed == 4 and subscriber.counts.other_schema == 1)
        assert isinstance(subscriber.error, SchemaError | BusError)
        put_until(publisher, EMPTY, came)
        assert subscriber.error is None


def test_where_nobody_listens_that_is_said(endpoint, monkeypatch):
    monkeypatch.setattr(link, "CONNECT_MS", 300)
    with pytest.raises(NoHubError, match="nobody listens there: start the process that is the hub") as absent:
        join(endpoint).open()
    assert "\n" not in str(absent.value)


def test_where_somebody_listens_who_does_not_let_us_in_that_is_said(monkeypatch):
    monkeypatch.setattr(link, "CONNECT_MS", 300)
    said = r"somebody listens there and did not, within 0\.3 s"
    with socket.create_server((HOST, 0)) as other, pytest.raises(BusError, match=said) as refused:
        join(f"tcp/{HOST}:{other.getsockname()[1]}").open()
    assert not isinstance(refused.value, NoHubError), "who drives must not take it for an empty cell"


def test_an_endpoint_that_is_taken_is_said_to_be(hub, endpoint):
    with pytest.raises(BusError, match="to be free, somebody listens there"):
        Bus(endpoint, serial=SERIAL, role=Role.TWIN, is_hub=True).open()


@pytest.mark.parametrize("is_hub", [True, False])
def test_off_loopback_nothing_is_opened(is_hub):
    with pytest.raises(BusConfigError, match="on loopback"):
        Bus("tcp/0.0.0.0:7447", serial=SERIAL, role=Role.TWIN, is_hub=is_hub).open()


LEFT_OPEN = """
import sys
from robot.bus import RESET, TRUTH, Bus, Role
bus = Bus(sys.argv[1], serial=sys.argv[2], role=Role.LEARNING)
bus.open()
subscriber, asker = bus.subscriber(TRUTH, print), bus.asker(RESET)
"""


def test_a_process_that_leaves_its_bus_open_ends(hub, endpoint):
    process = subprocess.run([sys.executable, "-c", LEFT_OPEN, endpoint, SERIAL], timeout=30.0, check=False)
    assert process.returncode == 0


def test_a_bus_that_nobody_holds_any_more_has_left(hub, endpoint):
    bus = join(endpoint)
    bus.open()
    bus.subscriber(TRUTH, print)
    until(lambda: hub.is_linked)
    del bus
    gc.collect()
    until(lambda: not hub.is_linked, timeout_s=5.0)


def test_closing_twice_does_nothing_and_what_is_closed_says_so(hub, endpoint):
    bus = join(endpoint, Role.TWIN, source="other")
    with pytest.raises(BusError, match="open it first"):
        bus.publisher(TRUTH)
    bus.open()
    publisher = bus.publisher(TRUTH)
    bus.close()
    bus.close()
    assert not bus.is_linked
    with pytest.raises(BusError, match="twin/truth: expected an open bus"):
        publisher.put(EMPTY)
    with pytest.raises(BusError, match="open it first"):
        bus.subscriber(TRUTH, print)


def test_a_writer_knows_whether_anybody_reads_it_across_the_hub_and_no_more_once_he_has_left(hub, endpoint):
    publishers = [hub.publisher(TRUTH)]
    with join(endpoint, Role.TWIN, source="other") as writer:
        publishers.append(writer.publisher(TRUTH))
        assert not any(publisher.is_read for publisher in publishers)
        with join(endpoint) as reader:
            reader.subscriber(TRUTH, lambda _: None)
            until(lambda: all(publisher.is_read for publisher in publishers))
        until(lambda: not any(publisher.is_read for publisher in publishers))
    assert not publishers[1].is_read, "of a bus that is closed nobody reads"
