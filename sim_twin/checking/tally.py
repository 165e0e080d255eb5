"""Results of streams added up by limit: the worst margin, how often it was broken, which stream to run again."""

import msgspec

from robot.bench import BenchResult
from sim_twin.checking.ring import StreamResult

__all__ = ["Breach", "LimitRow", "Tally"]

MOST_BREACHES = 200


class LimitRow(msgspec.Struct, frozen=True, kw_only=True):
    """One limit over all streams."""

    limit: str
    worst_margin_share: float
    value: float
    """What came there, in the limit's own unit."""
    stream: int
    family: str
    plant: str
    at_s: float
    detail: str
    violations: int
    """Streams in which it was broken."""


class Breach(msgspec.Struct, frozen=True, kw_only=True):
    """One limit broken in one stream."""

    limit: str
    stream: int
    family: str
    plant: str
    share: float
    value: float
    at_s: float
    detail: str


class Tally:
    """Adds up; keeps the first so many breaches, by number."""

    def __init__(self) -> None:
        self._rows: dict[str, LimitRow] = {}
        self._breaches: list[Breach] = []
        self._violations: dict[str, int] = {}
        self._by_plant: dict[str, int] = {}
        self._rest_ms: list[float] = []
        self.n_streams = self.n_commands = self.n_latches = 0

    def add(self, came: StreamResult) -> None:
        """Take in one stream."""
        self.n_streams += 1
        self.n_commands += came.n_commands
        self.n_latches += came.n_latches
        self._by_plant[came.plant] = self._by_plant.get(came.plant, 0) + 1
        if came.rest_ms is not None:
            self._rest_ms.append(came.rest_ms)
        for reading in came.readings:
            name = reading.limit
            if reading.is_broken:
                self._violations[name] = self._violations.get(name, 0) + 1
                self._breaches.append(
                    Breach(
                        limit=name,
                        stream=came.number,
                        family=came.family,
                        plant=came.plant,
                        share=reading.share,
                        value=reading.value,
                        at_s=round(reading.at_s, 4),
                        detail=reading.detail,
                    )
                )
            before = self._rows.get(name)
            if before is None or (reading.share, came.number) < (before.worst_margin_share, before.stream):
                self._rows[name] = LimitRow(
                    limit=name, worst_margin_share=reading.share, value=reading.value, stream=came.number,
                    family=came.family, plant=came.plant, at_s=round(reading.at_s, 4), detail=reading.detail,
                    violations=0,
                )  # fmt: skip

    @property
    def n_violations(self) -> int:
        """Limits broken, each counted once a stream."""
        return sum(self._violations.values())

    @property
    def rows(self) -> tuple[LimitRow, ...]:
        """One row a limit, the worst first."""
        rows = (
            msgspec.structs.replace(row, violations=self._violations.get(name, 0)) for name, row in self._rows.items()
        )
        return tuple(sorted(rows, key=lambda row: (row.worst_margin_share, row.limit)))

    @property
    def breaches(self) -> tuple[Breach, ...]:
        """Every breach up to a good many, by stream."""
        return tuple(sorted(self._breaches, key=lambda b: (b.stream, b.limit))[:MOST_BREACHES])

    @property
    def streams_by_plant(self) -> dict[str, int]:
        """How many streams each plant met."""
        return dict(sorted(self._by_plant.items()))

    def results(self) -> tuple[BenchResult, ...]:
        """Return the rows of the bench `safety`."""
        rows = self.rows
        rest = max(self._rest_ms, default=0.0)
        worst = rows[0].worst_margin_share if rows else 1.0
        return (
            BenchResult(name="streams", value=self.n_streams, unit="1"),
            BenchResult(name="commands", value=self.n_commands, unit="1"),
            BenchResult(name="violations", value=self.n_violations, unit="1", goal="0", ok=self.n_violations == 0),
            BenchResult(name="worst_margin_share", value=worst, unit="1"),
            BenchResult(name="rest_after_silence_ms_max", value=rest, unit="ms"),
            BenchResult(name="latches", value=self.n_latches, unit="1"),
        )
