"""What is heard on a bus, in words and tables for a person."""

from typing import Any

from rich.table import Column, Table

from robot.bus.inlet import Counts
from robot.bus.pace import Spread
from robot.bus.topic import Role
from robot.bus.topics import QUERIES
from robot.bus.watch import Listener, Seen

__all__ = ["counts_in_words", "delay_line", "rate_line", "seen_tables"]


def rate_line(listener: Listener[Any]) -> str:
    """Return how often messages came so far, how evenly, and what went wrong."""
    heard = listener.heard()
    if heard.heard_hz is None:
        return f"{heard.name}: {listener.pace.n} messages so far; {counts_in_words(heard.counts)}"
    asked = "on change" if heard.asked_hz is None else f"{heard.asked_hz:g} Hz in the table"
    return (
        f"{heard.name}: {heard.heard_hz:.1f} Hz ({asked}), every {_spread(listener.pace.intervals)}; "
        f"{counts_in_words(heard.counts)}"
    )


def delay_line(listener: Listener[Any]) -> str:
    """Return how old messages were when they came."""
    heard = listener.heard()
    if not listener.pace.n:
        return f"{heard.name}: nothing so far; {counts_in_words(heard.counts)}"
    ages = listener.pace.ages
    if ages is None:
        return f"{heard.name}: age unknown: the source is on another machine, whose clock has nothing to do with ours"
    limit = "" if heard.deadline_ms is None else f" (too old after {heard.deadline_ms:g})"
    return f"{heard.name}: {_spread(ages)} old{limit}; {counts_in_words(heard.counts)}"


def counts_in_words(counts: Counts) -> str:
    """Return what was wrong, by kind; that nothing was, otherwise."""
    wrong = {
        "lost": counts.lost, "duplicated": counts.duplicated, "reordered": counts.reordered, "late": counts.late,
        "of another schema": counts.other_schema, "malformed": counts.malformed, "restarts": counts.restarts,
    }  # fmt: skip
    told = [f"{n} {name}" for name, n in wrong.items() if n]
    return ", ".join(told) or "0 lost"


def seen_tables(seen: Seen) -> tuple[Table, ...]:
    """Return tables of processes, topics, queries and, if there are any, keys that are in no table."""
    processes = Table("process", "role", "there and back", "clock", title="who answers")
    for answer in seen.processes:
        clock = "this machine's" if answer.is_same_clock else "another's"
        processes.add_row(answer.source, answer.role, f"{answer.round_trip_ms:.2f} ms", clock)
    topics = Table(Column("topic", no_wrap=True), Column("type", no_wrap=True), "from", "Hz", "limit", "wrong")
    topics.title = "topics: in brackets who may write, where nobody does"
    for row in seen.topics:
        asked = "on change" if row.asked_hz is None else f"{row.asked_hz:g}"
        topics.add_row(
            row.name, row.kind, ", ".join(row.sources) or f"({', '.join(row.writers)})",
            asked if row.heard_hz is None else f"{row.heard_hz:.1f} of {asked}",
            "–" if row.deadline_ms is None else f"{row.deadline_ms:g} ms",
            row.error or (counts_in_words(row.counts) if row.counts.received else ""),
        )  # fmt: skip
    queries = Table("query", "asks", "answers", "answered by", title="queries")
    for query in QUERIES:
        by = "every process" if len(query.answered_by) == len(Role) else ", ".join(query.answered_by)
        queries.add_row(query.name, query.request.__name__, query.reply.__name__, by)
    tables = [processes, topics, queries]
    if seen.unknown_keys:
        unknown = Table("key", title="in no table")
        for key in seen.unknown_keys:
            unknown.add_row(key)
        tables.append(unknown)
    return tuple(tables)


def _spread(spread: Spread | None) -> str:
    if spread is None:
        return "–"
    return f"{spread.p50_ms:.2f} ms (p99 {spread.p99_ms:.2f}, max {spread.max_ms:.2f})"
