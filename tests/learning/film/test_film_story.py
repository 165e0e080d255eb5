import msgspec
import pytest

from learning.film.story import FILM_S, Card, Examined, Lived, allotted, story_of
from learning.report import load_run
from tests.support.toy_folder import make_toy_folder
from tests.support.toy_learner import CHANGE_EPOCH

replace = msgspec.structs.replace


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return load_run(make_toy_folder(tmp_path_factory.mktemp("toy") / "run"))


def test_a_story_is_learning_a_switch_what_it_broke_and_what_was_learnt_anew(run):
    story = story_of(run)
    kinds = [type(scene) for scene in story]
    assert kinds[:5] == [Card, Lived, Examined, Card, Lived]
    assert kinds[-1] is Card
    assert set(kinds[5:-1]) == {Examined}
    first, switch, broken = story[1], story[3], story[4]
    assert (first.at, first.n_epochs) == (0, 3)
    assert switch.at == CHANGE_EPOCH
    assert CHANGE_EPOCH <= broken.at < CHANGE_EPOCH + 30
    before, after = story[2], story[-2]
    assert (before.at, before.rules_epoch) == (CHANGE_EPOCH, CHANGE_EPOCH - 1)
    assert (after.at, after.rules_epoch) == (120, 119)


def test_the_goal_that_takes_the_most_trials_is_shown_and_what_failed_is_shown_again(run):
    story = story_of(run)
    hardest = [max(range(4), key=lambda g, o=optima: o[g] or 0) for optima in run.manifest.optima]
    assert story[2].goal == hardest[0]
    assert story[-2].goal == hardest[1]
    failed = next(row for row in run.goal_rows if row.epoch >= CHANGE_EPOCH and not row.is_achieved)
    assert story[4].at == failed.epoch
    again = [scene.goal for scene in story[5:-1]]
    assert again == ([failed.goal] if failed.goal != hardest[1] else []) + [hardest[1]]
    assert f"lamp {failed.goal} is not achieved" in story[4].says


def test_where_nothing_fails_after_a_switch_the_epoch_of_most_trials_is_shown(run):
    rows = tuple(
        replace(row, is_achieved=1, n_trials=7 if row.epoch == 70 else min(row.n_trials, 3)) for row in run.goal_rows
    )
    broken = story_of(replace(run, goal_rows=rows))[4]
    assert broken.at == 70
    assert "takes 7 trials" in broken.says


def test_a_run_that_came_to_no_switch_is_a_shorter_story(run):
    early = replace(
        run, summary=replace(run.summary, n_epochs=40, eras=run.summary.eras[:1]), goal_rows=run.goal_rows[:40]
    )
    assert [type(scene) for scene in story_of(early)] == [Card, Lived, Examined, Card]


def test_of_two_switches_the_second_ends_what_the_first_began(run):
    manifest = replace(run.manifest, changes=(60, 90), optima=(*run.manifest.optima, run.manifest.optima[0]))
    story = story_of(replace(run, manifest=manifest))
    assert (story[-2].at, story[-2].rules_epoch) == (90, 89)


@pytest.mark.parametrize("length_s", [0.5, 4.0, 30.0, 400.0])
def test_a_film_takes_a_minute_and_nothing_is_shown_slower_than_it_was(run, length_s):
    story = story_of(run)
    lengths = [0.0 if isinstance(scene, Card) else length_s for scene in story]
    seconds = allotted(story, lengths)
    assert sum(seconds) == pytest.approx(FILM_S)
    for scene, lasting, length in zip(story, seconds, lengths, strict=True):
        assert lasting >= 1.0
        if not isinstance(scene, Card):
            assert lasting <= length + 1.2 + 1e-9
