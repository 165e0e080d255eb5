"""A check that was interrupted goes on where it was; one of other limits, or of other code, begins."""

import msgspec
import pytest

from config.loader import resolve
from robot.teleop.wanted import Wanted
from sim_twin.checking import command, kept, weakened
from sim_twin.checking.check import Setup, part_of
from sim_twin.checking.kept import KeptOutcomes, KeptStreams, origin_of
from sim_twin.checking.mutations import Outcome
from sim_twin.checking.ring import StreamResult
from sim_twin.checking.weakenings import MUTATIONS
from sim_twin.readings import Reading


@pytest.fixture(scope="module")
def setup():
    resolved = resolve(rig="twin")
    return Setup(resolved=resolved, profile=resolved.profile, seed=0)


def came(number):
    readings = (Reading(limit="blow", share=0.1 + number, value=-float(number), is_broken=number == 7),)
    return StreamResult(number=number, family="reaches", plant="nominal", n_commands=3, n_latches=0, readings=readings)


def test_what_was_kept_is_what_came_and_a_block_is_done_when_all_of_it_is(setup, tmp_path):
    plain, search = part_of(setup, full=True)[0], part_of(setup, full=True)[-1]
    KeptStreams(tmp_path / "new", setup).add([came(n) for n in plain.streams])
    again = KeptStreams(tmp_path / "new", setup)
    assert again.of(plain) == [came(n) for n in plain.streams]
    assert again.of(search) is None
    again.add([came(n) for n in search.streams[:-1]])
    assert KeptStreams(tmp_path / "new", setup).of(search) is None
    again.add([came(search.streams[-1])])
    assert len(KeptStreams(tmp_path / "new", setup).of(search)) == search.n_streams


def test_streams_of_the_default_tenth_count_for_the_whole(setup, tmp_path):
    whole = KeptStreams(tmp_path, setup)
    for block in part_of(setup, full=True)[:40]:
        whole.add([came(n) for n in block.streams])
    read = KeptStreams(tmp_path, setup)
    assert any(read.of(block) for block in part_of(setup, full=False))


def test_a_line_that_was_cut_off_is_left_out_and_the_next_is_read(setup, tmp_path):
    first, second, third = part_of(setup, full=True)[:3]
    KeptStreams(tmp_path, setup).add([came(n) for n in first.streams])
    KeptStreams(tmp_path, setup).add([came(n) for n in second.streams])
    path = tmp_path / "streams.jsonl"
    path.write_bytes(path.read_bytes()[:-20])
    KeptStreams(tmp_path, setup).add([came(n) for n in third.streams])
    read = KeptStreams(tmp_path, setup)
    assert read.of(first)
    assert read.of(second) is None
    assert read.of(third)


def test_what_another_check_or_other_code_left_is_not_taken(setup, tmp_path, monkeypatch):
    (block, *_) = part_of(setup, full=True)
    KeptStreams(tmp_path, setup).add([came(n) for n in block.streams])
    assert KeptStreams(tmp_path, msgspec.structs.replace(setup, seed=1)).of(block) is None
    assert KeptStreams(tmp_path, msgspec.structs.replace(setup, n_commands=10)).of(block) is None
    monkeypatch.setattr(kept, "CODE", ("config", "robot"))
    assert KeptStreams(tmp_path, setup).of(block) is None


def test_one_byte_of_code_makes_another_origin(setup, tmp_path, monkeypatch):
    package = tmp_path / "somewhere"
    package.mkdir()
    (package / "__init__.py").write_text("A = 1\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(kept, "CODE", ("somewhere",))
    before = origin_of(setup)
    assert origin_of(setup) == before
    (package / "__init__.py").write_text("A = 2\n")
    assert origin_of(setup) != before


def test_a_check_that_was_interrupted_runs_what_is_left_and_reports_all(setup, tmp_path, monkeypatch):
    asked: list[tuple[int, ...]] = []

    def run(_, blocks, *, n_workers, heard, look):
        for k, block in enumerate(blocks):
            asked.append(block.streams)
            heard([came(n) for n in block.streams])
            if len(asked) == 5 and k == 4:
                raise KeyboardInterrupt

    monkeypatch.setattr(command, "check_streams", run)
    wanted = command.Wanted(out=tmp_path, n_blocks=12, n_workers=1)
    with pytest.raises(KeyboardInterrupt):
        command.measured(setup, wanted)
    report = command.measured(setup, wanted)
    blocks = part_of(setup, full=False)[:12]
    assert asked == [block.streams for block in blocks]
    assert next(r.value for r in report.results if r.name == "streams") == sum(b.n_streams for b in blocks)


def told(limit, *, is_caught=True):
    return Outcome(
        limit=limit, true_margin_share=0.1, weakened_margin_share=-0.02, is_held=True, is_caught=is_caught,
        family="steps", number=3,
    )  # fmt: skip


def test_limits_that_were_weakened_before_an_interruption_are_not_tried_again_and_all_are_reported(
    setup, tmp_path, monkeypatch
):
    names, tried = [m.name for m in MUTATIONS], []

    def run(coded, name):
        assert msgspec.json.decode(coded, type=Setup).profile == setup.profile
        tried.append(name)
        if len(tried) == 4:
            raise KeyboardInterrupt
        return told(name, is_caught=name != names[-1])

    monkeypatch.setattr(weakened, "run_mutation", run)
    wanted = Wanted(mutate=True, out=tmp_path, n_workers=1)
    with pytest.raises(KeyboardInterrupt):
        weakened.weaken_each(setup.resolved, wanted)
    answer = weakened.weaken_each(setup.resolved, wanted)
    assert tried == [*names[:4], *names[3:]]
    report = msgspec.json.decode(answer.json)
    assert [(row["limit"], row["is_caught"]) for row in report["outcomes"]] == [(n, n != names[-1]) for n in names]
    assert not answer.is_passed
    assert msgspec.json.decode((tmp_path / "weakened.json").read_bytes()) == report


def test_what_came_of_a_limit_under_other_limits_or_another_seed_is_not_taken(setup, tmp_path):
    KeptOutcomes(tmp_path, setup).add(told("box"))
    assert set(KeptOutcomes(tmp_path, setup).by_limit) == {"box"}
    other = setup.resolved.limits.profile("attended")
    assert KeptOutcomes(tmp_path, msgspec.structs.replace(setup, profile=other)).by_limit == {}
    assert KeptOutcomes(tmp_path, msgspec.structs.replace(setup, seed=1)).by_limit == {}
    assert KeptOutcomes(None, setup).by_limit == {}
