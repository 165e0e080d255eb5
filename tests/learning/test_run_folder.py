"""One run a folder, one process at a time, and errors that say what to do."""

from pathlib import Path

import msgspec
import pytest

from config.loader import resolve
from config.resolved import dump_resolved
from learning.errors import RunFolderError
from learning.run_folder import RunFolder
from learning.wanted import Wanted, refuse_another, resolve_wanted
from tests.support.small_lab import RULES, SCENARIO
from tests.support.toy_folder import toy_manifest

CONFIG = dump_resolved(resolve())
CONFIG_FILES = Path(__file__).parents[2] / "config"


def started(path):
    folder = RunFolder(path)
    with folder:
        folder.start(toy_manifest(seed=3), CONFIG)
    return folder


def test_a_started_folder_tells_what_is_run(tmp_path):
    folder = started(tmp_path / "run")
    assert folder.holds_run()
    assert folder.manifest() == toy_manifest(seed=3)
    assert folder.config() == resolve()


def test_a_second_start_in_the_same_folder_is_refused(tmp_path):
    folder = started(tmp_path)
    with folder, pytest.raises(RunFolderError, match=r"holds a run already: go on with it by --resume"):
        folder.start(toy_manifest(), CONFIG)


def test_a_folder_with_something_else_in_it_is_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("")
    folder = RunFolder(tmp_path)
    with folder, pytest.raises(RunFolderError, match=r"thesis\.tex"):
        folder.start(toy_manifest(), CONFIG)


def test_a_start_that_was_killed_half_way_can_be_made_again(tmp_path):
    folder = started(tmp_path)
    (tmp_path / "config.yaml").rename(tmp_path / "config.yaml.tmp")
    assert not folder.holds_run()
    assert started(tmp_path).holds_run()


def test_a_folder_in_use_is_refused_and_free_again_afterwards(tmp_path):
    with RunFolder(tmp_path), pytest.raises(RunFolderError, match="in use by another process"):
        RunFolder(tmp_path).__enter__()
    with RunFolder(tmp_path):
        pass


def test_a_folder_that_was_made_for_nothing_is_taken_away_again(tmp_path):
    with RunFolder(tmp_path / "new"):
        pass
    assert not (tmp_path / "new").exists()
    (tmp_path / "there").mkdir()
    with RunFolder(tmp_path / "there"):
        pass
    assert (tmp_path / "there").exists()


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match="expected a folder that can be written to"):
        RunFolder(tmp_path / "file" / "run").__enter__()


def test_what_is_no_run_folder_is_told(tmp_path):
    with pytest.raises(RunFolderError, match=r"found no run\.json"):
        RunFolder(tmp_path).manifest()
    (tmp_path / "run.json").write_text('{"format": 1}')
    with pytest.raises(RunFolderError, match="missing required field"):
        RunFolder(tmp_path).manifest()
    (tmp_path / "run.json").write_bytes(msgspec.json.encode(toy_manifest()).replace(b"lamps", b"l\xffmps"))
    with pytest.raises(RunFolderError, match=r"run\.json"):
        RunFolder(tmp_path).manifest()
    manifest = msgspec.structs.replace(toy_manifest(), format=99)
    (tmp_path / "run.json").write_bytes(msgspec.json.encode(manifest))
    with pytest.raises(RunFolderError, match="expected format 1, got 99"):
        RunFolder(tmp_path).manifest()


def test_judged_runs_evaluate_densely_and_epochs_may_be_given():
    protocol = resolve_wanted(Wanted(judged=True, epochs=30)).learning.experiment
    assert (protocol.epochs, protocol.dense_for, protocol.dense_every, protocol.test_epochs) == (30, 150, 10, 20)
    assert resolve_wanted(Wanted()) == resolve()


@pytest.mark.parametrize(
    ("wanted", "named"),
    [
        (Wanted(), None),
        (Wanted(scenario="paper", rig="twin", preset="default", seed=3), None),
        (Wanted(seed=4), "--seed"),
        (Wanted(scenario="workshop"), "--scenario"),
        (Wanted(preset="paper"), "--preset"),
        (Wanted(rig="fake"), "--rig"),
        (Wanted(epochs=5, judged=True), "--epochs and --judged"),
    ],
)
def test_going_on_with_another_run_than_asked_for_is_refused(wanted, named):
    resolved = resolve()
    if named is None:
        refuse_another(wanted, "folder", resolved, seed=3)
        return
    with pytest.raises(RunFolderError, match=f"another {named}: leave that out"):
        refuse_another(wanted, "folder", resolved, seed=3)


def test_going_on_after_a_scenarios_rule_file_was_changed_is_refused(tmp_path):
    (tmp_path / "small.yaml").write_text(SCENARIO)
    rules = tmp_path / "small_rules.yaml"
    rules.write_text(RULES)
    wanted = Wanted(scenario=str(tmp_path / "small.yaml"))
    resolved = resolve_wanted(wanted)
    refuse_another(wanted, "folder", resolved, seed=0)
    rules.write_text(RULES.replace("left_button", "right_button"))
    with pytest.raises(RunFolderError, match="another --scenario: leave that out"):
        refuse_another(wanted, "folder", resolved, seed=0)


def test_going_on_after_a_rigs_cell_file_was_changed_is_refused(tmp_path):
    rig, cell = (CONFIG_FILES / name for name in ("rigs/virtual_lab.yaml", "cells/ur_box.yaml"))
    (tmp_path / "rig.yaml").write_text(rig.read_text().replace("cell: ur_box", "cell: ./cell.yaml"))
    (tmp_path / "cell.yaml").write_text(cell.read_text())
    wanted = Wanted(rig=str(tmp_path / "rig.yaml"))
    resolved = resolve_wanted(wanted)
    refuse_another(wanted, "folder", resolved, seed=0)
    (tmp_path / "cell.yaml").write_text(cell.read_text().replace("pin: DI0", "pin: DI0, inverted: true"))
    with pytest.raises(RunFolderError, match="another --rig: leave that out"):
        refuse_another(wanted, "folder", resolved, seed=0)
