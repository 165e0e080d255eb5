"""What came of faults, kept by the tests that brought them about and printed as one table: `make faults`."""

import json
import os
import sys
from pathlib import Path

__all__ = ["KEPT", "as_table", "note_fault"]

KEPT = "AUTOTELIC_FAULT_TABLE"
"""Name of the environment's word for the file that rows are kept in; without it none are."""


def note_fault(node, what, came):
    """Keep what came of a fault."""
    if KEPT in os.environ:
        with Path(os.environ[KEPT]).open("a") as kept:
            kept.write(json.dumps([node, what, came]) + "\n")


def as_table(rows):
    """Return rows of (who, what, what came of it) as Markdown: who down, what across, the last word of each counts."""
    came = {(node, what): text for node, what, text in rows}
    lines = []
    for is_link in (False, True):
        some = [(node, what) for node, what in came if (node == "link") is is_link]
        nodes, faults = (list(dict.fromkeys(key[k] for key in some)) for k in (0, 1))
        if some:
            lines += ["| | " + " | ".join(faults) + " |", "|---" * (len(faults) + 1) + "|"]
            lines += [
                f"| {node} | " + " | ".join(came.get((node, what), "not run, or failed") for what in faults) + " |"
                for node in nodes
            ]
            lines.append("")
    return "\n".join(lines)


if __name__ == "__main__":
    kept = Path(sys.argv[1])
    sys.stdout.write(as_table(map(json.loads, kept.read_text().splitlines() if kept.exists() else ())))
