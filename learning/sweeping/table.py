"""How a sweep stands, as a table for a person. The edge: a terminal."""

from rich.progress_bar import ProgressBar
from rich.table import Table

from learning.sweeping.cells import epochs_done
from learning.sweeping.runner import SweepRunner

__all__ = ["Pace", "sweep_table"]

MINUTE_S = 60.0


class Pace:
    """Tells how long is left, by the epochs that went by since a sweep was taken up.

    Args:
        n_epochs: of one cell.
    """

    def __init__(self, runner: SweepRunner, *, n_epochs: int) -> None:
        self._runner, self.n_epochs = runner, n_epochs
        self._n_first = self.n_done

    @property
    def n_all(self) -> int:
        """Epochs of all cells."""
        return self.n_epochs * len(self._runner.cells)

    @property
    def n_done(self) -> int:
        """Epochs of all cells that are done."""
        folder = self._runner.folder
        return sum(min(self.n_epochs, epochs_done(cell, folder)) for cell in self._runner.cells)

    def left_s(self, seconds: float, n_done: int) -> float | None:
        """Return how long is left after so many seconds of this session and epochs; None while nothing is known."""
        n_new = n_done - self._n_first
        return seconds * (self.n_all - n_done) / n_new if n_new > 0 else None


def sweep_table(runner: SweepRunner, pace: Pace, *, seconds: float) -> Table:
    """Return one row a cell under way, and how all of them stand."""
    n_done = pace.n_done  # every cell's table is looked at for it
    left_s = pace.left_s(seconds, n_done)
    left = "" if left_s is None else f", about {left_s / MINUTE_S:.0f} min left"
    table = Table("cell", "epoch", "")
    table.title = (
        f"{runner.sweep.name}: {runner.n_finished} of {len(runner.cells)} cells, "
        f"{100 * n_done / pace.n_all:.0f} %{left}"
    )
    for name, task in runner.running.items():
        at = task.n_done()
        table.add_row(name, f"{at} of {pace.n_epochs}", ProgressBar(total=pace.n_epochs, completed=at, width=30))
    if runner.given_up:
        table.caption = f"given up: {', '.join(runner.given_up)}"
    return table
