import numpy as np
import pytest

from learning.film.lettering import lettering
from learning.film.sheet import SIZE_PX, VIEW_PX, Chart, GoalLine, card, sheet
from learning.report import load_run
from tests.support.toy_folder import make_toy_folder

WHITE = 255
LONG = "a test, learning off: what was wanted, at best in three trials, and some more words than a line has room for"


@pytest.fixture(scope="module")
def chart(tmp_path_factory):
    return Chart(load_run(make_toy_folder(tmp_path_factory.mktemp("toy") / "run")))


def inked(picture):
    return (picture != WHITE).any(axis=2)


@pytest.mark.parametrize(("bold", "px"), [(False, 20), (True, 28), (True, 42), (False, 26)])
def test_words_stay_inside_their_place_and_go_on_below(bold, px):
    picture = lettering(LONG, width=640, height=440, px=px, bold=bold)
    assert picture.shape == (440, 640, 3)
    rows, columns = np.nonzero(inked(picture))
    assert columns.max() < 636
    assert 3 < rows.min() < rows.max() < 437


def test_a_chart_shows_no_more_than_was_known(chart):
    colours = [(chart.until(epoch) != chart.until(0)).any(axis=2).sum() for epoch in (10, 30, 60, 120)]
    assert colours == sorted(colours)
    assert colours[0] < colours[-1] / 4
    early, late = chart.until(30), chart.until(120)
    columns = np.nonzero((early != late).any(axis=2))[1]
    assert columns.min() > 100  # what was shown at epoch 30 stays


@pytest.mark.parametrize("n", [1, 6, 24])
def test_every_goal_has_its_line_and_says_what_is_the_matter_with_it(chart, n):
    view = np.zeros((VIEW_PX[1], VIEW_PX[0], 3), np.uint8)
    colour = (0.2, 0.4, 0.6)
    lines = [GoalLine(name=f"goal {i}", colour=colour, says="wanted" * (i == 0), is_on=i % 2 == 1) for i in range(n)]
    page = sheet(view, title="t", says="s", now="epoch 3", goals=lines, chart=chart.until(0))
    assert page.shape == (SIZE_PX[1], SIZE_PX[0], 3)
    assert not page[90:, :840].any()
    below = page[458:, 840:]
    dots = (below == (np.array(colour) * 255).astype(np.uint8)).all(axis=2).any(axis=1)
    n_dots = int((np.diff(np.concatenate([[0], dots.astype(int)])) == 1).sum())
    assert n_dots == n
    plain = sheet(view, title="t", says="s", now="epoch 3", goals=[GoalLine(name=line.name, colour=colour, says="",
                  is_on=line.is_on) for line in lines], chart=chart.until(0))  # fmt: skip
    assert (plain != page).any()


def test_a_card_is_words_beside_the_chart(chart):
    page = card(title="Epoch 1000: the rules change", says=LONG, chart=chart.until(60))
    assert page.shape == (SIZE_PX[1], SIZE_PX[0], 3)
    words, drawn = inked(page[:, :800]), inked(page[:, 824:])
    assert words.any()
    assert drawn.any()
    assert not words[:, :40].any()
