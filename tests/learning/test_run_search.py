"""Runs found under a path, and word of each folder that was not taken for one."""

import pytest

from config.loader import resolve
from config.resolved import dump_resolved
from learning.errors import RunFolderError
from learning.run_folder import RunFolder
from learning.run_search import find_runs
from tests.support.toy_folder import toy_manifest

CONFIG = dump_resolved(resolve())


def started(path):
    folder = RunFolder(path)
    with folder:
        folder.start(toy_manifest(seed=3), CONFIG)
    return path


def names(found):
    return [folder.path.name for folder in found.folders]


def test_a_folder_of_runs_stands_for_its_runs(tmp_path):
    for name in ("b", "a"):
        started(tmp_path / name)
    (tmp_path / "notes").mkdir()
    assert names(find_runs(tmp_path)) == ["a", "b"]
    assert names(find_runs(tmp_path / "b")) == ["b"]
    for path in (tmp_path / "notes", tmp_path / "absent"):
        with pytest.raises(RunFolderError, match=r"expected a run folder .* found no run\.json$"):
            find_runs(path)


@pytest.mark.parametrize(
    ("missing", "beside"),
    [(("run.json",), "trials.csv"), (("config.yaml",), "run.json"), (("run.json", "config.yaml"), "trials.csv")],
)
def test_a_run_that_lacks_what_it_began_with_is_told_and_not_passed_over(tmp_path, missing, beside):
    started(tmp_path / "whole")
    half = started(tmp_path / "half")
    (half / "trials.csv").write_text("")
    for name in missing:
        (half / name).unlink()
    found = find_runs(tmp_path)
    assert names(found) == ["whole"]
    assert found.passed_over == ()
    (line,) = found.broken
    assert line.startswith(
        f"{half}: expected run.json and config.yaml beside {beside}, found no {' and '.join(missing)}: bring"
    )
    with pytest.raises(RunFolderError, match=f"found no {' and '.join(missing)}:"):
        find_runs(half)


def test_folders_of_something_else_are_told_only_if_they_hold_something_of_a_run(tmp_path):
    started(tmp_path / "a")
    started(tmp_path / "more" / "b")
    for folder, file in (("figures", "figure2.png"), ("presets", "config.yaml"), ("report", "summary.json")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / file).write_text("")
    found = find_runs(tmp_path)
    assert (names(found), found.broken) == (["a"], ())
    assert found.passed_over == (
        f"{tmp_path / 'more'}: holds runs further in, name it itself: {tmp_path / 'more' / 'b'}",
        f"{tmp_path / 'presets'}: holds config.yaml, but no run",
        f"{tmp_path / 'report'}: holds summary.json, but no run",
    )


def test_where_there_is_no_run_the_error_tells_what_was_passed_over(tmp_path):
    started(tmp_path / "more" / "b")
    with pytest.raises(RunFolderError, match=r"found no run\.json; passed over .*more: holds runs further in"):
        find_runs(tmp_path)
