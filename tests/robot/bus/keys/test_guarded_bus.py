"""A bus at a tls endpoint, with real certificates and real links: who has no business there has no effect there."""

import json
import socket
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta

import pytest
import zenoh

from robot.bus import Bus, Role, link
from robot.bus.errors import BusConfigError, BusError
from robot.bus.keys import Keyring
from robot.bus.keys.guard import Guard, guard_of
from robot.bus.topic import key_of
from robot.bus.topics import QUERIES, RESET, TOPICS, TRUTH, ResetRequest
from robot.messages import SceneState

pytestmark = pytest.mark.realtime

HOST, SERIAL = "127.0.0.68", "1"
SCENE = SceneState(stamp_ns=1, objects=())


def free_endpoint():
    with socket.create_server((HOST, 0)) as free:
        return f"tls/{HOST}:{free.getsockname()[1]}"


def issue_all(folder, *roles, now=None, days=1):
    now = now or datetime.now(UTC)
    keyring = Keyring(folder)
    keyring.init(now=now)
    for role in roles:
        keyring.issue(role, source="", hosts=(HOST,) if role is Role.TWIN else (), days=days, now=now)
    return keyring


@pytest.fixture(scope="module")
def keyring(tmp_path_factory):
    made = issue_all(tmp_path_factory.mktemp("keys"), *Role)
    gone = made.issue(Role.LEARNING, source="gone", hosts=(), days=1, now=datetime.now(UTC))
    made.revoke(gone.name, now=datetime.now(UTC))
    return made


@pytest.fixture(scope="module")
def endpoint():
    return free_endpoint()


@pytest.fixture(scope="module")
def hub(keyring, endpoint):
    with Bus(endpoint, serial=SERIAL, role=Role.TWIN, is_hub=True, keys=str(keyring.folder)) as bus:
        yield bus


@contextmanager
def listening(raw):
    """Yield everything that any key brings to a hub, who answers whatever it is asked."""
    samples = []
    subscriber = raw.declare_subscriber("**", lambda sample: samples.append(str(sample.key_expr)))
    queryable = raw.declare_queryable("**", lambda query: query.reply(query.key_expr, b"done"))
    yield samples
    queryable.undeclare()
    subscriber.undeclare()


@pytest.fixture
def seen(hub):
    with listening(hub.raw()) as samples:
        yield samples


def join(endpoint, folder, role, **more):
    return Bus(endpoint, serial=SERIAL, role=role, keys=str(folder), **more)


def until(is_true, timeout_s=15.0):
    end = time.monotonic() + timeout_s
    while not is_true():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_rightful_process_reads_and_asks_over_an_encrypted_link(hub, keyring, endpoint):
    publisher, answerer, came = hub.publisher(TRUTH), hub.answerer(RESET), []
    with join(endpoint, keyring.folder, Role.LEARNING) as learner, ThreadPoolExecutor(1) as pool:
        learner.subscriber(TRUTH, came.append)
        until(lambda: publisher.put(SCENE) or came)
        asked = pool.submit(learner.asker(RESET).ask, ResetRequest(seed=1, epoch=2, digital_out=0))
        until(lambda: (got := answerer.next()) and (got.refuse("not now") or True))
        with pytest.raises(BusError, match="not now"):
            asked.result()


def strike(endpoint, keyring, source, asked, wait_s=0.1):
    """With a process's certificate, past our own door: put on every topic, ask these queries; return who answered."""
    guard = guard_of(keyring.folder, source, is_hub=False, now=datetime.now(UTC))
    raw = link.open_link(endpoint, is_hub=False, guard=guard)
    try:
        for topic in TOPICS:
            raw.put(key_of(SERIAL, topic.name), b"forged")
        keys = [key_of(SERIAL, query.name) for query in asked]
        answered = [str(reply.ok or reply.err) for key in keys for reply in raw.get(key, payload=b"{}", timeout=wait_s)]
        time.sleep(0.2)
    finally:
        raw.close()
    return answered


@pytest.mark.parametrize("role", [r for r in Role if r is not Role.TWIN])
def test_a_certificate_lets_its_role_write_its_own_topics_and_no_other(hub, keyring, endpoint, seen, role):
    answered = strike(endpoint, keyring, str(role), [query for query in QUERIES if role not in query.asked_by])
    rightful = {key_of(SERIAL, topic.name) for topic in TOPICS if role in topic.writers}
    assert set(seen) == rightful
    assert answered == []


@pytest.mark.parametrize("source", ["viewer", "gone"])
def test_without_the_rules_the_same_strike_is_seen_on_every_topic_and_every_question_answered(keyring, source):
    there = free_endpoint()
    ruled = guard_of(keyring.folder, "twin", is_hub=True, now=datetime.now(UTC))
    bare = Guard(settings={key: value for key, value in ruled.settings.items() if key != "access_control"})
    assert bare != ruled
    unruled = link.open_link(there, is_hub=True, guard=bare)
    try:
        with listening(unruled) as seen:
            answered = strike(there, keyring, source, QUERIES, wait_s=15.0)
            until(lambda: set(seen) == {key_of(SERIAL, topic.name) for topic in TOPICS})
    finally:
        unruled.close()
    assert len(answered) == len(QUERIES)


def test_a_revoked_certificate_comes_in_and_can_do_nothing(hub, keyring, endpoint, seen):
    answered, came = strike(endpoint, keyring, "gone", QUERIES), []
    with join(endpoint, keyring.folder, Role.LEARNING, source="gone") as revoked:
        revoked.subscriber(TRUTH, came.append)
        publisher = hub.publisher(TRUTH)
        for _ in range(20):
            publisher.put(SCENE)
            time.sleep(0.01)
    assert (set(seen), answered, came) == ({key_of(SERIAL, TRUTH.name)}, [], [])  # the hub's own


def refused(endpoint, **settings):
    config = zenoh.Config()
    tls = {
        "root_ca_certificate": settings.pop("root"),
        "enable_mtls": True,
        "verify_name_on_connect": False,
        **settings,
    }
    for key, value in {
        "mode": "client", "scouting/multicast/enabled": False, "connect/endpoints": [endpoint],
        "connect/timeout_ms": 1500, "connect/exit_on_failure": True, "transport/link/tls": tls,
    }.items():  # fmt: skip
        config.insert_json5(key, json.dumps(value))
    try:
        zenoh.open(config).close()
    except zenoh.ZError:
        return True
    return False


def test_no_certificate_one_of_another_authority_one_that_is_over_and_a_plain_link_are_kept_out(
    hub, keyring, endpoint, tmp_path
):
    other = issue_all(tmp_path / "other", Role.TELEOP).folder / "teleop"
    now = datetime.now(UTC)
    over = keyring.issue(Role.TELEOP, source="late", hosts=(), days=1, now=now - timedelta(days=2))
    root, late = str(keyring.folder / "authority.pem"), keyring.folder / over.source

    def shown(folder):
        return {"connect_certificate": str(folder / "certificate.pem"), "connect_private_key": str(folder / "key.pem")}

    rightful = {"root": root, **shown(keyring.folder / "teleop")}
    tries = [{"root": root}, {"root": root, **shown(other)}, {"root": root, **shown(late)}]
    plain = endpoint.replace("tls/", "tcp/")
    assert not refused(endpoint, **rightful)
    with ThreadPoolExecutor(4) as pool:
        outcomes = [pool.submit(refused, endpoint, **each) for each in tries] + [pool.submit(refused, plain, root=root)]
    assert [outcome.result() for outcome in outcomes] == [True] * 4


def test_a_process_refuses_a_hub_that_is_not_the_authoritys_or_listens_where_it_may_not(keyring, tmp_path, monkeypatch):
    monkeypatch.setattr(link, "CONNECT_MS", 1000)
    there = free_endpoint()
    imposter = issue_all(tmp_path / "imposter", Role.TWIN)
    with (
        Bus(there, serial=SERIAL, role=Role.TWIN, is_hub=True, keys=str(imposter.folder)),
        pytest.raises(BusError, match=r"one that refuses us.*keys list"),
    ):
        join(there, keyring.folder, Role.LEARNING).open()
    client = free_endpoint()
    with (
        Bus(client, serial=SERIAL, role=Role.LEARNING, is_hub=True, keys=str(keyring.folder)),
        pytest.raises(BusError, match="one that refuses us"),
    ):
        join(client, keyring.folder, Role.VIEWER).open()


def test_a_hub_needs_the_ledger_and_a_process_its_certificate(keyring, endpoint, tmp_path):
    with pytest.raises(BusConfigError, match="autotelic keys issue ROLE --source nobody"):
        join(endpoint, keyring.folder, Role.TELEOP, source="nobody").open()
    copied = tmp_path / "copied"
    (copied / "twin").mkdir(parents=True)
    for name in ("authority.pem", "twin/certificate.pem", "twin/key.pem"):
        (copied / name).write_bytes((keyring.folder / name).read_bytes())
    (copied / "twin/key.pem").chmod(0o600)
    with pytest.raises(BusConfigError, match="hub's machine needs its ledger"):
        Bus(free_endpoint(), serial=SERIAL, role=Role.TWIN, is_hub=True, keys=str(copied)).open()
