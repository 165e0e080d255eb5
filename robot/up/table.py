"""How the processes of a rig are, as a table for a person. The edge: a terminal."""

from rich.table import Table

from robot.up.supervisor import Supervisor

__all__ = ["status_table"]


def status_table(supervisor: Supervisor) -> Table:
    """Return one row a process, and the last thing that happened below."""
    table = Table("node", "process", "rate / target", "late", "age", "memory", "starts", "is", "last error")
    for name, node in supervisor.nodes.items():
        heard, age_s = supervisor.book[name], supervisor.book.age_s(name)
        health = heard.health
        pid = "–" if node.child is None else str(node.child.pid)
        if health is None or age_s is None:
            table.add_row(name, pid, "–", "–", "–", "–", str(node.n_starts), "not heard", "")
            continue
        target = "" if health.target_hz is None else f" / {health.target_hz:.0f}"
        table.add_row(
            name, pid, f"{health.rate_hz:.1f}{target} Hz", f"{health.late_ms:.1f} ms", f"{age_s:.1f} s",
            f"{health.rss_mb:.0f} MB", str(node.n_starts), health.doing, health.last_error[:60],
        )  # fmt: skip
    if supervisor.events:
        last = supervisor.events[-1]
        table.caption = f"{last.at_s:.1f} s, {last.node}: {last.what}"
    return table
