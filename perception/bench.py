"""`autotelic bench perception`: what is seen on pictures whose truth is known, by how bad the pictures are."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from time import perf_counter, thread_time

from config.loader import resolve
from config.resolved import Resolved
from perception.calibrated import calibrated, printed
from perception.calibration.board import Board
from perception.calibration.camera_file import CameraFile
from perception.detection import ColourFile, Detections, Detector
from perception.detection.arm_outline import arm_outlines
from perception.detection.eye import Eye
from perception.labelled import LabelledFolder
from perception.preparing import STUDIO, learnt
from perception.scoring import Score, f1_of, percentile, score, total, upper_bound
from robot.bench import BenchReport, BenchResult, bench_report
from robot.description import forward_kinematics
from robot.messages import Vec3
from robot.photographs import Photograph, Photographer
from robot.rigs import load

__all__ = ["FIRST_SEED", "bench_perception", "level_results", "overall_results"]

CLEAN = "clean"
LEVELS = (CLEAN, "mild", "medium", "strong")
FIRST_SEED = 1_000_000
"""Pictures of seeds from 800,000 to 899,999 were looked at while thresholds were chosen, 900,001 is the guided
sample's and 910,001 the boards'."""
N_SHORT, N_FULL = 3, 500
SHARPNESS = 1.5
DATE = "2026-01-01"
MEAN_GOAL_MM, P95_GOAL_MM, DISTANCE_GOAL_MM, F1_GOAL, FALSE_GOAL, FRAME_GOAL_MS = 2.0, 4.0, 3.0, 0.999, 0.001, 10.0


def bench_perception(*, full: bool, frames: Path | None = None) -> BenchReport:
    """Calibrate by rendered boards, learn colours from a guided sample, then look at seeded pictures of each level.

    Args:
        full: takes 500 pictures a level.
        frames: a folder of measured photographs to look at instead, with the camera's files (docs/perception.md).
    """
    begun = perf_counter()
    resolved = resolve()
    looker, scores = _photographed(resolved, frames) if frames is not None else _rendered(resolved, full=full)
    results = [*overall_results(scores), *_time_results(looker.first_ms, looker.next_ms)]
    for level, came in scores.items():
        results += level_results(level, came)
    return bench_report("perception", results, seconds=perf_counter() - begun)


def _rendered(resolved: Resolved, *, full: bool) -> "tuple[_Looker, dict[str, Score]]":
    studio: Photographer = load(STUDIO)(resolved, sharpness=SHARPNESS)
    try:
        board = Board()
        camera = calibrated(board, studio.boards(printed(board)), resolved.scenario, date=DATE)
        looker = _Looker(resolved, camera, learnt(studio, camera, resolved))
        seeds = range(FIRST_SEED, FIRST_SEED + (N_FULL if full else N_SHORT))
        return looker, {level: total(looker.scores(studio.photographs(seeds, level))) for level in LEVELS}
    finally:
        studio.close()


def _photographed(resolved: Resolved, folder: Path) -> "tuple[_Looker, dict[str, Score]]":
    taken = LabelledFolder(folder, resolved.scenario)
    looker = _Looker(resolved, taken.camera, taken.colours)
    return looker, {level: total(looker.scores(taken.photographs(level))) for level in taken.levels}


class _Looker:
    """Looks at photographs and keeps how long each took."""

    def __init__(self, resolved: Resolved, camera: CameraFile, colours: ColourFile) -> None:
        self._resolved, self._eye = resolved, Eye(camera)
        self._detector = Detector(camera=camera, scenario=resolved.scenario, colours=colours)
        self.first_ms: list[float] = []
        """Of pictures of tables that were never seen before."""
        self.next_ms: list[float] = []
        """Of the same, when it is known where things were in the picture before."""

    def scores(self, photographs: Iterator[Photograph]) -> Iterator[Score]:
        for photograph in photographs:
            seen, first_ms = self._timed(photograph, {})
            near = {thing.name: thing.position_m for thing in seen.things if thing.position_m is not None}
            self.first_ms.append(first_ms)
            self.next_ms.append(self._timed(photograph, near)[1])
            tcp_m: Vec3 | None = None
            if photograph.q_rad is not None:
                x, y, z = forward_kinematics(self._resolved.arm, photograph.q_rad)[:3, 3].tolist()
                tcp_m = (x, y, z)
            yield score(photograph, seen, self._resolved.scenario, tcp_m)

    def _timed(self, photograph: Photograph, near: Mapping[str, Vec3]) -> tuple[Detections, float]:
        """Look at a picture, its arm's outlines reckoned too, and return the processor time that it took (ms)."""
        q_rad, begun = photograph.q_rad, thread_time()
        outlines = [] if q_rad is None else arm_outlines(self._resolved.arm, q_rad, photograph.opening_m, self._eye)
        seen = self._detector.look(photograph.frame, outlines, near)
        return seen, 1e3 * (thread_time() - begun)


def overall_results(scores: dict[str, Score]) -> list[BenchResult]:
    """Return the rows over all levels, with what is asked of each."""
    whole = total(scores.values())
    clean = scores.get(CLEAN, Score())
    perturbed = total(s for level, s in scores.items() if level != CLEAN)
    n_wrong, n_told = clean.lamps[1] + clean.lamps[2], sum(clean.lamps[:4])
    bound = {"n": str(n_told), "rate_below": f"{upper_bound(n_wrong, n_told):.4f} at 95 %"}
    f1, false = f1_of(perturbed.lamps), whole.n_false / max(whole.n_things, 1)
    return [
        _at_most("position_mean_mm", 1e3 * _mean(whole.errors_m), "mm", MEAN_GOAL_MM, n=len(whole.errors_m)),
        _at_most("position_p95_mm", 1e3 * percentile(whole.errors_m, 95), "mm", P95_GOAL_MM),
        _at_most("distance_mean_mm", 1e3 * _mean(whole.distance_errors_m), "mm", DISTANCE_GOAL_MM),
        BenchResult(
            name="lamp_errors_clean", value=float(n_wrong), unit="1", goal="= 0", ok=n_wrong == 0 and n_told > 0,
            details=bound,
        ),
        BenchResult(
            name="lamp_f1_perturbed", value=f1, unit="ratio", goal=f">= {F1_GOAL:g}", ok=f1 >= F1_GOAL,
            details={"n": str(sum(perturbed.lamps[:4]))},
        ),
        _at_most("false_known_share", false, "share", FALSE_GOAL, n=whole.n_things),
    ]  # fmt: skip


def level_results(level: str, came: Score) -> list[BenchResult]:
    """Return one level's rows: nothing is asked of them by itself."""
    n_told = sum(came.lamps[:4])
    n_wrong = float(came.lamps[1] + came.lamps[2])
    wrong = [] if level == "clean" else [BenchResult(name=f"lamp_errors_{level}", value=n_wrong, unit="1")]
    return [
        *wrong,
        BenchResult(name=f"position_mean_mm_{level}", value=1e3 * _mean(came.errors_m), unit="mm"),
        BenchResult(name=f"position_p95_mm_{level}", value=1e3 * percentile(came.errors_m, 95), unit="mm"),
        BenchResult(
            name=f"placed_share_{level}", value=len(came.errors_m) / max(came.n_seeable, 1), unit="share",
            details={"of": f"{came.n_seeable} not in a shut box"},
        ),
        BenchResult(name=f"false_known_{level}", value=float(came.n_false), unit="1"),
        BenchResult(name=f"lamp_told_share_{level}", value=n_told / max(sum(came.lamps), 1), unit="share"),
        BenchResult(name=f"lid_errors_{level}", value=float(came.lids[1]), unit="1"),
        BenchResult(name=f"lid_told_share_{level}", value=sum(came.lids[:2]) / max(sum(came.lids), 1), unit="share"),
    ]  # fmt: skip


def _time_results(first_ms: Sequence[float], next_ms: Sequence[float]) -> list[BenchResult]:
    """Return processor time a picture where things are followed, and where they are looked for all over."""
    warm = first_ms[1:]  # the first one warms up
    return [
        _at_most("frame_ms_p50", percentile(next_ms, 50), "ms", FRAME_GOAL_MS, n=len(next_ms)),
        _at_most("frame_ms_p99", percentile(next_ms, 99), "ms", FRAME_GOAL_MS),
        BenchResult(name="first_frame_ms_p50", value=percentile(warm, 50), unit="ms"),
        BenchResult(name="first_frame_ms_p99", value=percentile(warm, 99), unit="ms"),
    ]


def _at_most(name: str, value: float, unit: str, goal: float, *, n: int | None = None) -> BenchResult:
    result = BenchResult(name=name, value=value, unit=unit, goal=f"<= {goal:g}", ok=value <= goal)
    if n is None:
        return result
    return BenchResult(name=name, value=value, unit=unit, goal=result.goal, ok=result.ok, details={"n": str(n)})


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else float("inf")
