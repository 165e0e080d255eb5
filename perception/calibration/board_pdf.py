"""A board as a PDF page to scale, with a bar to measure. Text out of numbers; nothing is read or written here.

One unit of a PDF is 1/72 inch (ISO 32000-1, 8.3.2.3) and its y goes up the page.
"""

from perception.calibration.board import Board, Box, black_boxes, check_board
from perception.errors import PerceptionConfigError

__all__ = ["BAR_MM", "PAPERS_MM", "board_pdf"]

UNITS_PER_MM = 72.0 / 25.4
PAPERS_MM = {"a4": (297.0, 210.0), "a3": (420.0, 297.0), "letter": (279.4, 215.9)}
"""Landscape."""
BAR_MM = 100.0
BAR_THICK_MM = 2.0
BAR_GAP_MM = 4.0
"""Between the board and the bar."""
UNPRINTED_MM = 4.0
"""What a printer may leave out along the paper's edge."""
TEXT_UNITS = 8


def board_pdf(board: Board, *, paper: str = "a4") -> bytes:
    """Return one page with the board in the middle and a bar of 100 mm below it.

    Raises:
        PerceptionConfigError: no such paper, or the board and its bar do not fit on it.
    """
    check_board(board)
    if paper not in PAPERS_MM:
        raise PerceptionConfigError(f"expected a paper of {', '.join(PAPERS_MM)}, came {paper!r}")
    width, height = PAPERS_MM[paper]
    wide, high = 1e3 * board.n_columns * board.square_m, 1e3 * board.n_rows * board.square_m
    needs = (max(wide, BAR_MM) + 2 * UNPRINTED_MM, high + 2 * (BAR_GAP_MM + BAR_THICK_MM + UNPRINTED_MM))
    if needs[0] > width or needs[1] > height:
        raise PerceptionConfigError(
            f"expected a board that leaves room for the bar on {paper} ({width:g} × {height:g} mm), this one needs "
            f"{needs[0]:g} × {needs[1]:g}: fewer or smaller squares, or a larger paper"
        )
    left, upper = (width - wide) / 2, (height - high) / 2
    boxes = [_on_page(box, left, upper, height) for box in black_boxes(board)]
    bar = (left, height - upper - high - BAR_GAP_MM - BAR_THICK_MM, BAR_MM, BAR_THICK_MM)
    content = "\n".join([*_rectangles([*boxes, bar]), "f", *_words(board, left + BAR_MM + 3.0, bar[1])])
    return _document(content, width * UNITS_PER_MM, height * UNITS_PER_MM)


def _on_page(box: Box, left: float, upper: float, height: float) -> tuple[float, float, float, float]:
    """Return left, lower, width and height in mm of the page, whose y goes up."""
    x0, y0, x1, y1 = (1e3 * value for value in box)
    return left + x0, height - upper - y1, x1 - x0, y1 - y0


def _rectangles(boxes: list[tuple[float, float, float, float]]) -> list[str]:
    """Return one path of all boxes. Filled at once there is no seam between those that touch."""
    return [" ".join(f"{UNITS_PER_MM * value:.4f}" for value in box) + " re" for box in boxes]


def _words(board: Board, x_mm: float, y_mm: float) -> list[str]:
    text = (
        f"The bar is {BAR_MM:g} mm long: print at 100 %, measure it. {board.n_columns} x {board.n_rows} squares of "
        f"{1e3 * board.square_m:g} mm, markers {board.dictionary} of {1e3 * board.marker_m:g} mm"
    )
    place = f"{UNITS_PER_MM * x_mm:.4f} {UNITS_PER_MM * y_mm:.4f}"
    return ["BT", f"/F1 {TEXT_UNITS} Tf", f"{place} Td", f"({text}) Tj", "ET"]


def _document(content: str, width: float, height: float) -> bytes:
    """Return a PDF file of one page: catalogue, pages, page, content, font, table of where each begins."""
    stream = content.encode("ascii")
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        (
            f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width:.4f} {height:.4f}] /Contents 4 0 R "
            "/Resources << /Font << /F1 5 0 R >> >> >>"
        ).encode("ascii"),
        b"<< /Length %d >>\nstream\n%s\nendstream" % (len(stream), stream),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
    ]
    out = bytearray(b"%PDF-1.4\n")
    starts = []
    for number, body in enumerate(objects, start=1):
        starts.append(len(out))
        out += b"%d 0 obj\n%s\nendobj\n" % (number, body)
    table = len(out)
    out += b"xref\n0 %d\n0000000000 65535 f \n" % (len(objects) + 1)
    out += b"".join(b"%010d 00000 n \n" % start for start in starts)
    out += b"trailer\n<< /Size %d /Root 1 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (len(objects) + 1, table)
    return bytes(out)
