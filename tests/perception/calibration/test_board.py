"""The board on paper: to scale by the PDF's own numbers, and readable by the detector that will look for it."""

import re

import numpy as np
import pytest
from typer.testing import CliRunner

from perception.calibration.board import Board, black_boxes, board_picture, corner_points
from perception.calibration.board_pdf import PAPERS_MM, board_pdf
from perception.calibration.camera_file import load_board
from perception.calibration.sighting import Finder
from perception.errors import PerceptionConfigError
from robot.cli import app

MM_PER_UNIT = 25.4 / 72
BOARDS = [Board(), Board(n_columns=9, n_rows=6, square_m=0.025, marker_m=0.018, dictionary="4X4_50")]


def page_of(pdf):
    """Size of the page and its rectangles, in mm."""
    text = pdf.decode("ascii")
    media = [float(n) for n in re.search(r"/MediaBox \[([\d. ]+)\]", text)[1].split()]
    boxes = [
        [float(n) * MM_PER_UNIT for n in found]
        for found in re.findall(r"^([\d.-]+) ([\d.-]+) ([\d.-]+) ([\d.-]+) re$", text, re.M)
    ]
    return [n * MM_PER_UNIT for n in media[2:]], np.array(boxes)


@pytest.mark.parametrize("board", BOARDS)
@pytest.mark.parametrize("paper", ["a4", "a3"])
def test_squares_and_bar_measure_on_paper_what_they_should(board, paper):
    (width, height), boxes = page_of(board_pdf(board, paper=paper))
    assert (width, height) == pytest.approx(PAPERS_MM[paper], abs=1e-3)
    bars = boxes[np.isclose(boxes[:, 2], 100.0, atol=1e-3)]
    assert len(bars) == 1
    squares = boxes[
        np.isclose(boxes[:, 2], 1e3 * board.square_m, atol=1e-3)
        & np.isclose(boxes[:, 3], 1e3 * board.square_m, atol=1e-3)
    ]
    assert len(squares) == (board.n_columns * board.n_rows + 1) // 2
    printed = boxes[~np.isclose(boxes[:, 2], 100.0, atol=1e-3)]
    ends = (
        (printed[:, 0] + printed[:, 2]).max() - printed[:, 0].min(),
        (printed[:, 1] + printed[:, 3]).max() - printed[:, 1].min(),
    )
    assert ends == pytest.approx(
        (1e3 * board.n_columns * board.square_m, 1e3 * board.n_rows * board.square_m), abs=1e-3
    )
    assert (boxes[:, :2] >= 4.0).all()
    assert ((boxes[:, 0] + boxes[:, 2]) <= width - 4.0).all()


def test_every_offset_in_the_pdf_is_where_its_object_begins():
    pdf = board_pdf(Board())
    start = int(re.search(rb"startxref\n(\d+)", pdf)[1])
    assert pdf[start:].startswith(b"xref\n0 6")
    for number, offset in enumerate(re.findall(rb"^(\d{10}) 00000 n", pdf[start:], re.M), start=1):
        assert pdf[int(offset) :].startswith(b"%d 0 obj" % number)
    length = int(re.search(rb"/Length (\d+)", pdf)[1])
    assert pdf[pdf.index(b"stream\n") + 7 + length :].startswith(b"\nendstream")


@pytest.mark.parametrize("board", BOARDS)
def test_the_detector_finds_every_corner_of_the_printed_board_in_its_place(board):
    sheet = board_picture(board, px_per_m=2000.0, margin_m=0.01)
    seen = Finder(board).find(np.repeat(sheet[..., None], 3, axis=2), "sheet")
    assert seen.corners == tuple(range((board.n_columns - 1) * (board.n_rows - 1)))
    expected = (corner_points(board)[:, :2] + 0.01) * 2000.0 - 0.5
    assert np.array(seen.pixels) == pytest.approx(expected, abs=0.05)


def test_black_boxes_do_not_overlap():
    sheet = np.zeros((1800, 2520))
    for left, upper, right, lower in black_boxes(Board()):
        x0, y0, x1, y1 = (round(v * 1e4) for v in (left, upper, right, lower))
        sheet[y0:y1, x0:x1] += 1
    assert sheet.max() == 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"square_m": 0.06, "marker_m": 0.045}, "leaves room for the bar"),
        ({"marker_m": 0.034}, "markers of at most"),
        ({"n_columns": 16, "n_rows": 13, "square_m": 0.01, "marker_m": 0.007}, "a dictionary of 104"),
    ],
)
def test_a_board_that_cannot_be_printed_is_refused_in_words(changes, words):
    with pytest.raises(PerceptionConfigError, match=words):
        board_pdf(Board(**changes))


def test_the_command_writes_pdf_and_file_and_refuses_what_is_none(tmp_path):
    out = tmp_path / "board.pdf"
    done = CliRunner().invoke(
        app, ["calibrate", "board", str(out), "--squares", "9x6", "--square-mm", "25", "--marker-mm", "18"]
    )
    assert done.exit_code == 0, done.output
    assert load_board(tmp_path / "board.yaml") == Board(n_columns=9, n_rows=6, square_m=0.025, marker_m=0.018)
    assert out.read_bytes() == board_pdf(Board(n_columns=9, n_rows=6, square_m=0.025, marker_m=0.018))
    for wrong in (["--squares", "9"], ["--dictionary", "7X7"], ["--square-mm", "0"], ["--paper", "b5"]):
        refused = CliRunner().invoke(app, ["calibrate", "board", str(tmp_path / "no.pdf"), *wrong])
        assert refused.exit_code == 2, refused.output
    assert not (tmp_path / "no.pdf").exists()
