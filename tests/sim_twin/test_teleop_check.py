import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from typer.testing import CliRunner

from config.limits import JointLimit, Profile
from config.loader import resolve
from config.values import Section
from robot.cli import app as root
from robot.messages import Hold, Twist
from robot.teleop import Send, Silence, Write
from robot.teleop.battery import FAMILIES
from robot.teleop.cli import CHECKERS, IN_SHADOW, PROBERS
from robot.teleop.cli import app as teleop
from sim_twin.checking.check import FULL_STREAMS, N_COMMANDS, Setup, check_streams, part_of, rerun
from sim_twin.checking.mutations import try_mutation
from sim_twin.checking.report import CheckReport
from sim_twin.checking.ring import Ring, StreamResult
from sim_twin.checking.tally import Tally
from sim_twin.checking.weakenings import MUTATIONS, NOT_SHOWN
from sim_twin.perturb import NOMINAL, PERTURBATIONS
from sim_twin.readings import Reading

SHORT = 40
SPEEDS = ("command_tcp_speed", "command_flange_speed", "command_elbow_speed", "elbow_speed", "command_acceleration")
GIVEN_WAY = (*SPEEDS, "command_stop_acceleration", "command_stop_jerk")
FORCES = ("force:fingers-object", "steady_force")
SWUNG = ("tcp_speed", "flange_speed", "elbow_speed")
MENDED = (
    pytest.param("attended", 2400, SPEEDS, id="writes that give way to nothing"),
    pytest.param("attended", 721, SPEEDS, id="joints that outran the elbow"),
    pytest.param("attended", 3036, SPEEDS, id="a search for the base column", marks=pytest.mark.slow),
    pytest.param("attended", 588, GIVEN_WAY, id="a light push that was fallen back from at once"),
    pytest.param("unattended", 799, GIVEN_WAY, id="a light push again and again", marks=pytest.mark.slow),
    pytest.param("attended", 922, ("steady_force",), id="a bare pad on a button's rim"),
    pytest.param("unattended", 1376, ("steady_force",), id="a pad on a rim, at a fence", marks=pytest.mark.slow),
    pytest.param("unattended", 2043, ("steady_force",), id="a pad on a rim, no load", marks=pytest.mark.slow),
    pytest.param("unattended", 2536, ("steady_force",), id="a pad on a rim, loaded", marks=pytest.mark.slow),
    pytest.param("attended", 747, ("grip_opening",), id="fingers pressed apart"),
    pytest.param("unattended", 747, ("grip_opening",), id="fingers pressed apart, faster", marks=pytest.mark.slow),
    pytest.param("unattended", 791, ("grip_opening",), id="fingers swung apart, loaded", marks=pytest.mark.slow),
    pytest.param("unattended", 1839, ("grip_opening",), id="fingers swung apart, at a box", marks=pytest.mark.slow),
    pytest.param("unattended", 2337, ("grip_opening",), id="fingers swung apart, circling", marks=pytest.mark.slow),
    pytest.param("unattended", 2965, ("box:table_top",), id="half a stop past an edge", marks=pytest.mark.slow),
    pytest.param("unattended", 2772, ("box:table_top",), id="half a stop past the lid", marks=pytest.mark.slow),
    pytest.param("unattended", 588, FORCES, id="a cylinder met by a tool that caught up", marks=pytest.mark.slow),
    pytest.param("unattended", 2133, FORCES[1:], id="leaves met by a tool that caught up", marks=pytest.mark.slow),
    pytest.param("attended", 965, FORCES[1:], id="held against a fence by a cap", marks=pytest.mark.slow),
    pytest.param("attended", 742, ("steady_force",), id="a finger that slid into a ring", marks=pytest.mark.slow),
    pytest.param("unattended", 231, ("steady_force",), id="fingers aslant on a lid's edge", marks=pytest.mark.slow),
    pytest.param("attended", 2357, SWUNG, id="a finger that came off a rim", marks=pytest.mark.slow),
    pytest.param("attended", 2908, SWUNG, id="turned round, nominal", marks=pytest.mark.slow),
    pytest.param("attended", 2986, SWUNG, id="turned round, loaded", marks=pytest.mark.slow),
)
"""Streams of the batteries, seed 0, and limits that were broken there."""


@pytest.fixture(scope="module")
def attended():
    resolved = resolve(rig="twin")
    profile = resolved.limits.profile("attended")
    rig = msgspec.structs.replace(resolved.rig, profile="attended")
    return Setup(resolved=msgspec.structs.replace(resolved, rig=rig), profile=profile, seed=0)


@pytest.fixture(scope="module")
def resolved():
    return resolve(rig="twin")


def setup_of(resolved, **values) -> Setup:
    return Setup(resolved=resolved, profile=resolved.profile, seed=0, **values)


@pytest.fixture(scope="module")
def ring(resolved):
    made = Ring(resolved, NOMINAL, resolved.profile, n_commands=SHORT)
    yield made
    made.close()


def run(ring: Ring, asks) -> StreamResult:
    return ring.run(lambda look, arena: iter(asks), number=0, family="test", seed=0)


def test_the_whole_battery_is_as_long_as_it_must_be_and_meets_every_plant(resolved):
    blocks = part_of(setup_of(resolved), full=True)
    assert sum(b.n_streams for b in blocks) == FULL_STREAMS >= 3000
    assert FULL_STREAMS * N_COMMANDS >= 1_000_000
    assert {b.plant for b in blocks if b.search is None} == set(range(len(PERTURBATIONS)))
    numbers = [n for b in blocks for n in b.numbers]
    assert len(set(numbers)) == len(numbers)


def test_the_default_is_a_tenth_drawn_by_the_seed(resolved):
    part = part_of(setup_of(resolved), full=False)
    assert FULL_STREAMS / 11 < sum(b.n_streams for b in part) < FULL_STREAMS / 8
    assert part == part_of(setup_of(resolved), full=False)
    other = part_of(msgspec.structs.replace(setup_of(resolved), seed=1), full=False)
    assert {b.numbers for b in part} != {b.numbers for b in other}
    assert {b.plant for b in part} == set(range(len(PERTURBATIONS)))


def test_a_stream_alone_is_the_same_as_among_others(resolved):
    setup = setup_of(resolved, n_commands=SHORT)
    heard: list[StreamResult] = []
    block = next(b for b in part_of(setup, full=False) if b.search is None)
    check_streams(setup, (block,), n_workers=1, heard=heard.extend)
    assert [came.number for came in heard] == list(block.numbers)
    again, _ = rerun(setup, block.numbers[-1])
    assert again == heard[-1]


def test_a_stream_of_a_search_is_found_again(resolved):
    setup = setup_of(resolved, n_commands=10)
    block = next(b for b in part_of(setup, full=True) if b.search is not None)
    heard: list[StreamResult] = []
    check_streams(setup, (block,), n_workers=1, heard=heard.extend)
    again, _ = rerun(setup, block.search.first + 9)
    assert again == heard[9]


def test_a_stream_that_is_not_there_is_refused(resolved):
    with pytest.raises(ValueError, match="expected a stream from 0 to"):
        rerun(setup_of(resolved), FULL_STREAMS)


def test_commands_are_counted_and_a_latched_station_is_asked_on_in_vain(ring):
    fast = Send(Twist(linear_m_s=(0.1, 0.0, 0.0)))
    came = run(ring, [fast] * 5 + [Send(None)] + [fast] * SHORT)
    assert came.n_commands == SHORT
    assert came.n_latches == 1


def test_silence_comes_to_rest_and_is_timed(ring):
    came = run(ring, [Send(Twist(linear_m_s=(0.3, 0.0, 0.0)))] * 30 + [Silence(60)])
    assert came.n_latches == 0
    assert 50.0 < came.rest_ms < 600.0


def test_a_command_past_all_shaping_meets_the_gate(ring):
    q = ring.look().q_rad
    came = run(ring, [Write(q_rad=(q[0] + 1.0, *q[1:]))] + [Send(Hold())] * 5)
    assert came.n_latches == 1
    came = run(ring, [Write(q_rad=ring.look().q_rad, stamp_off_ns=-(10**9))])
    assert came.n_latches == 1


def reading(limit="tcp_speed", share=0.1, broken=False) -> Reading:
    return Reading(limit=limit, share=share, value=1.0, is_broken=broken)


def result(number: int, *readings: Reading) -> StreamResult:
    return StreamResult(number=number, family="f", plant="nominal", n_commands=7, n_latches=1, readings=readings)


def test_a_tally_keeps_the_worst_of_each_limit_and_counts_streams_that_broke_it():
    tally = Tally()
    tally.add(result(1, reading(share=0.2), reading("box", -0.3, broken=True)))
    tally.add(result(2, reading(share=-0.1, broken=True), reading("box", -0.2, broken=True)))
    tally.add(result(3, reading(share=0.5)))
    assert [(r.limit, r.worst_margin_share, r.stream, r.violations) for r in tally.rows] == [
        ("box", -0.3, 1, 2),
        ("tcp_speed", -0.1, 2, 1),
    ]
    assert (tally.n_streams, tally.n_commands, tally.n_violations) == (3, 21, 3)
    assert [r.ok for r in tally.results()] == [True, True, False, True, True, True]
    assert [b.stream for b in tally.breaches] == [1, 2, 2]


def ask(*words: str):
    return CliRunner().invoke(teleop, ["check", *words])


def test_a_short_check_answers_one_object_and_its_exit_code_says_what_came(tmp_path):
    came = ask("--commands", "30", "--blocks", "1", "--workers", "1", "--json", "--out", str(tmp_path))
    report = msgspec.json.decode(came.stdout, type=CheckReport)
    assert came.exit_code == (0 if report.is_passed else 1)
    rows = {row.name: row.value for row in report.results}
    assert rows["streams"] == 8
    assert 8 <= rows["commands"] <= 8 * 30 + 80
    assert {"violations", "worst_margin_share", "rest_after_silence_ms_max"} <= set(rows)
    assert json.loads((tmp_path / "check.json").read_text())["bench"] == "safety"
    assert (tmp_path / "margins.png").stat().st_size > 10_000


def test_one_stream_is_shown_alone():
    came = ask("--commands", "30", "--stream", "1", "--profile", "attended")
    assert came.exit_code in (0, 1)
    assert "streams 1," in came.stdout


def test_a_check_that_finds_something_fails(monkeypatch):
    monkeypatch.setattr("sim_twin.checking.command._many", lambda *_: broken_tally())
    came = ask()
    assert came.exit_code == 1
    assert "violations 1" in came.stdout


def broken_tally() -> Tally:
    tally = Tally()
    tally.add(result(5, reading(share=-0.2, broken=True)))
    return tally


def test_a_check_that_finds_nothing_passes(monkeypatch):
    tally = Tally()
    tally.add(result(5, reading()))
    monkeypatch.setattr("sim_twin.checking.command._many", lambda *_: tally)
    assert ask().exit_code == 0


@pytest.mark.parametrize("words", [("--rig", "fake"), ("--rig", "fake", "--probe"), ("--rig", "twin", "--probe")])
def test_a_rig_that_nobody_checks_is_refused_before_anything_is_connected_to(words, monkeypatch):
    def never(*_: object) -> None:
        raise AssertionError("nothing may be built")

    monkeypatch.setattr("robot.teleop.cli.load", never)
    came = CliRunner().invoke(root, ["teleop", "check", *words])
    assert came.exit_code == 2
    assert "nothing moves" in came.output


def test_an_arm_on_a_wire_is_checked_in_shadow_alone():
    assert {kind: CHECKERS[kind] for kind in ("virtual", "real")} == dict.fromkeys(("virtual", "real"), IN_SHADOW)
    assert CHECKERS["twin"] != IN_SHADOW
    assert set(PROBERS) == {"virtual", "real"}


@pytest.mark.parametrize("word", ["--full", "--mutate", "--stream=1", "--seed=0", "--blocks=1"])
def test_what_chooses_among_streams_is_refused_beside_a_probe_list(word):
    came = CliRunner().invoke(root, ["teleop", "check", "--rig", "virtual_lab", "--probe", word])
    assert came.exit_code == 2
    assert "expected no --" in came.output


@pytest.mark.parametrize("words", [("--profile", "reckless"), ("--rig", "nowhere"), ("--stream", "-1")])
def test_bad_usage_is_told_apart_from_a_failed_check(words):
    assert CliRunner().invoke(root, ["teleop", "check", *words]).exit_code == 2


@pytest.mark.slow
def test_the_workers_of_an_interrupted_check_are_gone():
    command = [str(Path(sys.executable).parent / "autotelic"), "teleop", "check", "--workers", "2"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)
    time.sleep(8.0)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 1
    assert b"interrupted" in err
    end = time.monotonic() + 10.0
    while is_anyone_left(process.pid) and time.monotonic() < end:
        time.sleep(0.1)
    assert not is_anyone_left(process.pid)


def is_anyone_left(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_every_value_of_a_profile_is_weakened_or_said_why_not():
    named = [*(place for m in MUTATIONS for place in m.limits), *NOT_SHOWN]
    known = {re.sub(r"\[\d]", "", place) for place in named}
    assert known == set(values_of(Profile))
    assert len(set(named)) == len(named)


def values_of(of: type, where: str = "") -> Iterator[str]:
    """Where a profile's values stand: those of a section, and of each joint; fences and pairs are one each."""
    for field in msgspec.structs.fields(of):
        kind = JointLimit if field.name == "joints" else field.type
        if isinstance(kind, type) and issubclass(kind, Section):
            yield from values_of(kind, f"{where}{field.name}.")
        elif field.name != "name":
            yield where + field.name


def test_a_limit_that_binds_is_no_wider_than_what_it_was_and_the_weaker_one_is_by_a_twentieth(attended):
    profile = attended.profile
    for mutation in MUTATIONS:
        true = mutation.tighten(profile)
        assert true != profile, mutation.name
        assert mutation.weaken is None or mutation.weaken(true) != true, mutation.name
        assert (mutation.weaken is None) is (mutation.fit is not None), mutation.name
        assert set(mutation.families) <= set(FAMILIES), mutation.name


@pytest.mark.parametrize("name", ["greatest grip force", "joint stop jerk"])
def test_a_limit_weakened_by_a_twentieth_is_told(attended, name):
    mutation = next(m for m in MUTATIONS if m.name == name)
    outcome = try_mutation(attended.resolved, mutation, seed=0, n_streams=1, n_commands=250)
    assert outcome.is_held, outcome
    assert outcome.is_caught, outcome


@pytest.mark.slow
@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda m: m.name)
@pytest.mark.parametrize("profile", ["attended", "unattended"])
def test_each_limit_weakened_alone_by_a_twentieth_is_told(resolved, mutation, profile):
    held = msgspec.structs.replace(resolved, rig=msgspec.structs.replace(resolved.rig, profile=profile))
    outcome = try_mutation(held, mutation, seed=0)
    assert outcome.is_held, outcome
    assert outcome.is_caught, outcome


@pytest.mark.parametrize(("profile", "number", "kept"), MENDED)
def test_a_stream_that_broke_a_limit_keeps_it(attended, resolved, profile, number, kept):
    setups = {"attended": attended, "unattended": setup_of(resolved)}
    assert setups[profile].profile.name == profile
    came, _ = rerun(setups[profile], number)
    assert [b for b in came.broken if b.limit in kept] == []
    assert {r.limit for r in came.readings} >= set(kept)
