"""`autotelic bus`, as a person uses it, beside a hub that writes truth at 100 Hz."""

import json
import socket
import threading

import msgspec
import pytest
from typer.testing import CliRunner

import robot.cli
from robot.bus import TRUTH, Bus, Role
from robot.bus.pace import Pace, spread_of
from robot.bus.topic import key_of
from robot.messages import ObjectPose, SceneState
from tests.support.small_lab import SERIAL, make_lab

pytestmark = pytest.mark.realtime

HOST = "127.0.0.101"
POSE = ObjectPose(name="chest", position_m=(float("nan"), 0.0, 1.0), quat=(1.0, 0.0, 0.0, 0.0))


def free_endpoint():
    with socket.create_server((HOST, 0)) as free:
        return f"tcp/{HOST}:{free.getsockname()[1]}"


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """Return what runs `autotelic bus` on a rig whose twin writes."""
    rig = make_lab(tmp_path_factory.mktemp("lab"), HOST, bus=free_endpoint())
    endpoint = msgspec.yaml.decode(rig.read_bytes())["bus"]
    is_over = threading.Event()
    with Bus(endpoint, serial=SERIAL, role=Role.TWIN, is_hub=True) as hub:
        publisher = hub.publisher(TRUTH)

        def write():
            while not is_over.wait(0.01):
                publisher.put(SceneState(stamp_ns=0, objects=(POSE,)))
                hub.raw().put(key_of(SERIAL, "odd/topic"), b"")

        writer = threading.Thread(target=write)
        writer.start()
        yield lambda *words: autotelic("bus", *words, "--rig", rig)
        is_over.set()
        writer.join()


def autotelic(*words):
    result = CliRunner().invoke(robot.cli.app, [str(word) for word in words])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def test_list_tells_who_is_there_what_is_written_how_often_and_what_is_in_no_table(lab):
    result = lab("list", "--seconds", 0.5, "--json")
    assert result.exit_code == 0, result.output
    seen = json.loads(result.stdout)
    assert [process["source"] for process in seen["processes"]] == ["twin"]
    truth = next(topic for topic in seen["topics"] if topic["name"] == "twin/truth")
    assert truth["sources"] == ["twin"]
    assert 10 < truth["heard_hz"] < 120
    assert truth["counts"]["lost"] == 0
    assert seen["unknown_keys"] == [key_of(SERIAL, "odd/topic")]
    assert all(topic["heard_hz"] is None for topic in seen["topics"] if topic["name"] != "twin/truth")


def test_list_is_a_table_for_a_person(lab):
    result = lab("list", "--seconds", 0.2)
    assert result.exit_code == 0, result.output
    for word in ("twin/truth", "SceneState", "station/reset", "odd/topic", "who answers"):
        assert word in result.stdout


def test_echo_prints_messages_with_their_numbers_in_words_where_they_are_not_finite(lab):
    result = lab("echo", "twin/truth", "-n", 2, "--json")
    assert result.exit_code == 0, result.output
    first, second = (json.loads(line) for line in result.stdout.splitlines())
    assert second["sequence"] > first["sequence"]
    assert first["source"] == "twin"
    assert first["message"]["objects"][0]["position_m"] == ["~NaN", 0.0, 1.0]
    assert "twin " in lab("echo", "twin/truth", "-n", 1).stdout


def test_rate_and_delay_tell_of_a_topic_and_fail_where_nothing_comes(lab):
    rate = lab("rate", "twin/truth", "--seconds", 0.5)
    assert "Hz (100 Hz in the table), every" in rate.stdout
    delay = lab("delay", "twin/truth", "--seconds", 0.5)
    assert "old (too old after 100)" in delay.stdout
    assert (rate.exit_code, delay.exit_code) == (0, 0)
    for command in ("rate", "delay", "echo"):
        result = lab(command, "percept", "--seconds", 0.2)
        assert result.exit_code == 1
        assert "percept: expected something, nothing came" in result.stderr


def test_ping_tells_how_long_each_process_takes(lab):
    result = lab("ping", "-n", 1)
    assert result.exit_code == 0
    assert result.stdout.startswith("twin (twin, this machine): ")
    assert len(json.loads(lab("ping", "-n", 1, "--json").stdout)) == 1


def test_a_topic_that_is_in_no_table_is_refused_with_those_that_are(lab):
    result = lab("echo", "twin/trut")
    assert result.exit_code == 2
    assert "twin/truth" in result.stderr


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("--rig", "twin"), 2, "expected a bus, it has none"),
        (("--bus", "tcp/192.168.1.20:7447"), 2, "on loopback"),
        (("--rig", "lab"), 2, "expected.serial"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(words, code, said):
    result = autotelic("bus", "list", *words)
    assert (result.exit_code, result.stderr.count("\n")) == (code, 1)
    assert said in result.stderr


def test_where_no_hub_is_that_is_said_in_one_line(monkeypatch):
    monkeypatch.setattr("robot.bus.link.CONNECT_MS", 300)
    result = autotelic("bus", "ping", "--bus", free_endpoint())
    assert (result.exit_code, result.stderr.count("\n")) == (1, 1)
    assert "nobody listens there" in result.stderr


def test_a_pace_is_reckoned_from_arrivals():
    pace = Pace()
    assert (pace.rate_hz, pace.intervals, pace.ages) == (None, None, None)
    for k, age_ns in enumerate((2_000_000, None, 4_000_000)):
        pace.note(1_000_000_000 + k * 10_000_000, age_ns)
    assert pace.rate_hz == pytest.approx(100.0)
    assert (pace.intervals.n, pace.intervals.p50_ms, pace.ages.n, pace.ages.max_ms) == (2, 10.0, 2, 4.0)
    assert spread_of(list(range(1, 101))).p99_ms == 100e-6
