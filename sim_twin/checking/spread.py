"""Work spread over processes that leave nobody behind when a person has had enough. An edge."""

import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from multiprocessing import get_context
from typing import TypeVar

__all__ = ["n_processors", "spread"]

LOOK_S = 0.2
T = TypeVar("T")
R = TypeVar("R")


def n_processors() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0))


def spread(
    work: Callable[[T], R],
    items: Sequence[T],
    *,
    n_workers: int,
    heard: Callable[[R], None],
    look: Callable[[], object] = lambda: None,
) -> None:
    """Do the work on so many processes, and tell of each item's result as it comes.

    Args:
        work: importable by its name, for it is done in other processes.
        items: of each of which it is done once.
        n_workers: how many processes; one is this one.
        heard: told of each result.
        look: called now and then; what it raises ends the work.

    Raises:
        KeyboardInterrupt: a person had enough; no worker is left behind.
    """
    if n_workers == 1:
        for item in items:
            heard(work(item))
            look()
        return
    pool = ProcessPoolExecutor(n_workers, mp_context=get_context("spawn"), initializer=_leave_ctrl_c)
    futures: list[Future[R]] = []
    try:
        futures.extend(pool.submit(work, item) for item in items)
        pending = set(futures)
        while pending:
            done, pending = wait(pending, timeout=LOOK_S, return_when=FIRST_COMPLETED)
            look()
            for future in done:
                heard(future.result())
    finally:
        for future in futures:
            future.cancel()
        pool.shutdown(wait=True, cancel_futures=True)


def _leave_ctrl_c() -> None:
    """A worker ends when its pool does: Ctrl-C is for the process that a person started."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ["OMP_NUM_THREADS"] = "1"
