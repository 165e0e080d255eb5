"""One case as a cell: tested, gone on with, tested again, in a folder of its own. The edge: files.

It is a job like a sweep's. What it came to so far lies in its folder, goal by goal and checkpoint by checkpoint, so
that it goes on wherever it was killed, to the same result.
"""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import msgspec

from learning.assess import assess
from learning.checkpoint import write_atomically
from learning.errors import LearningError
from learning.progress import Progress
from learning.robustness.cases import Case, under_case
from learning.robustness.fork import fork, learnt_state
from learning.robustness.result import CaseResult, Plan
from learning.rows import EvaluationRow
from learning.run_folder import RunFolder
from learning.session import open_session
from learning.stopwatch import Stopwatch
from learning.wanted import Wanted

__all__ = ["n_steps_done", "read_result", "run_case"]

BEFORE_NAME, RESULT_NAME = "before.json", "result.json"


def run_case(
    run: RunFolder,
    plan: Plan,
    case: Case,
    folder: Path,
    *,
    now_s: Callable[[], float],
    progress_of: Callable[[RunFolder, int], Progress],
    should_stop: Callable[[], bool],
) -> CaseResult | None:
    """Carry a case out, or the rest of it; None where it was stopped before its end.

    Args:
        run: what is tried.
        plan: how much.
        case: under what.
        folder: of the case.
        now_s: the host's monotonic time, to book where it went.
        progress_of: makes what is told how the learning goes, of its folder and the epochs done.
        should_stop: asked between goals and epochs.

    Raises:
        LearningError: the run is not the one that the plan is about any more.
    """
    own = RunFolder(folder)
    with own:
        if not own.holds_run():
            _fork(run, plan, case, own)
        before = _test(own, plan, should_stop)
        if len(before) < len(own.manifest().goals):
            return None
        if plan.n_more and not _go_on(own, now_s, progress_of, should_stop):
            return None
        result = CaseResult(
            case=case.name,
            before=before,
            after=tuple(own.evaluations()) if plan.n_more else (),
            looks=tuple(own.graphs()),
            n_void=sum(row.is_void for row in own.goals()),
        )
        _write(folder / RESULT_NAME, msgspec.json.encode(result))
    return result


def read_result(folder: Path) -> CaseResult | None:
    """Return what a case came to, None where it is not done.

    Raises:
        LearningError: it cannot be read.
    """
    path = folder / RESULT_NAME
    try:
        return msgspec.json.decode(path.read_bytes(), type=CaseResult)
    except FileNotFoundError:
        return None
    except (OSError, msgspec.DecodeError, UnicodeDecodeError) as error:
        raise LearningError(f"{path}: expected what a case came to, got {error}: delete it to have it anew") from error


def n_steps_done(folder: Path) -> int:
    """Return how far a case is: goals tested, and epochs gone on for as its checkpoints tell."""
    checkpoints = sorted((folder / "checkpoints").glob("checkpoint-*.zip"))
    return len(_tested(folder)) + (int(checkpoints[-1].stem.rsplit("-", 1)[-1]) if checkpoints else 0)


def _fork(run: RunFolder, plan: Plan, case: Case, own: RunFolder) -> None:
    state, resolved = learnt_state(run), run.config()
    if state["n_done"] != plan.n_done or run.manifest().config_sha256 != plan.config_sha256:
        raise LearningError(
            f"{run.path}: expected the run after its epoch {plan.n_done}, it is another one or has gone on to epoch "
            f"{state['n_done']} since: begin again in another folder by --out"
        )
    gone_on = under_case(resolved, case, n_done=plan.n_done, n_more=plan.n_more, n_tests=plan.n_tests)
    fork(own, gone_on, state, seed=plan.seed)


class _Stopped(Exception):  # noqa: N818 - no error: how a test is left between two goals
    pass


def _test(own: RunFolder, plan: Plan, should_stop: Callable[[], bool]) -> tuple[EvaluationRow, ...]:
    """Test what was learnt, goal by goal, those left out that were tested already."""
    rows = list(_tested(own.path))
    left = [goal for goal in range(len(own.manifest().goals)) if goal not in {row.goal for row in rows}]

    def keep(row: EvaluationRow) -> None:
        rows.append(row)
        _write(own.path / BEFORE_NAME, msgspec.json.encode(rows))
        if should_stop():
            raise _Stopped

    if left:
        with suppress(_Stopped):
            assess(own, n_tests=plan.n_tests, seed=None, rules_epoch=None, goals=left, when_tested=keep)
    return tuple(rows)


def _tested(folder: Path) -> list[EvaluationRow]:
    try:
        return msgspec.json.decode((folder / BEFORE_NAME).read_bytes(), type=list[EvaluationRow])
    except (OSError, msgspec.DecodeError, UnicodeDecodeError):
        return []


def _go_on(
    own: RunFolder,
    now_s: Callable[[], float],
    progress_of: Callable[[RunFolder, int], Progress],
    should_stop: Callable[[], bool],
) -> bool:
    """Learn on from the newest checkpoint; return whether that came to its end."""
    session = open_session(own, Wanted(), resume=True, stopwatch=Stopwatch(now_s))
    try:
        with progress_of(own, session.n_done) as progress:
            return session.run(progress, n_workers=0, should_stop=should_stop).is_finished
    finally:
        session.close()


def _write(path: Path, raw: bytes) -> None:
    write_atomically(path, msgspec.json.format(raw, indent=1) + b"\n")
