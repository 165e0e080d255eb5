"""What is started for a rig, and how long to wait before it is started again. Pure, and state of one node."""

import string
from collections import deque
from collections.abc import Collection, Mapping, Sequence

import msgspec

from config.rig import Rig
from robot.errors import RobotConfigError

__all__ = ["Backoff", "NodePlan", "is_own_end", "plans_of"]

FIRST_S, MOST_S = 0.5, 30.0
MANY, WITHIN_S = 6, 600.0
"""More restarts than this within so long and it is given up."""
BLAMED_S = 60.0
"""A job that ends so soon after what it needs was away ended for that: it waits 30 s for a robot node itself."""
JOB = "job"


class NodePlan(msgspec.Struct, frozen=True, kw_only=True):
    """One process to be started."""

    name: str
    kind: str
    words: tuple[str, ...]
    """Of the `autotelic` command."""
    is_by_hand: bool = False
    """A person starts it, in a terminal of its own."""


def plans_of(
    rig: Rig, values: Mapping[str, str], *, without: Collection[str] = (), more: Sequence[str] = ()
) -> tuple[NodePlan, ...]:
    """Return what is to be started, in order.

    Args:
        rig: which nodes there are.
        values: for the names in braces.
        without: nodes that are left out.
        more: words for the job's command.

    Raises:
        RobotConfigError: it names no nodes, none that holds an arm, or a name in braces that there is not; or what is
            left out is none of them.
    """
    names = [node.name for node in rig.nodes]
    if not any(node.kind == "robot" for node in rig.nodes) or len(set(names)) != len(names):
        raise RobotConfigError(
            f"rig {rig.name}: expected `nodes:`, each with a name of its own and one that holds the arm (kind: robot), "
            f"came {', '.join(names) or 'none'}; a rig whose arm is in process is one process: `autotelic learn --rig`"
        )
    unknown = set(without) - set(names)
    if unknown:
        raise RobotConfigError(f"--without: expected some of {', '.join(names)}, came {', '.join(sorted(unknown))}")
    return tuple(
        NodePlan(
            name=node.name, kind=node.kind, is_by_hand=node.is_by_hand,
            words=(*(_filled(word, values, node.name) for word in node.command), *(more if node.kind == "job" else ())),
        )
        for node in rig.nodes if node.name not in without
    )  # fmt: skip


def _filled(word: str, values: Mapping[str, str], node: str) -> str:
    try:
        names = [name for _, name, _, _ in string.Formatter().parse(word) if name is not None]
    except ValueError as error:
        raise RobotConfigError(f"nodes: {node}: expected words with names in braces, came {word!r}: {error}") from error
    for name in names:
        if name not in values:
            raise RobotConfigError(f"nodes: {node}: expected one of {', '.join(sorted(values))} in braces, came {name}")
        word = word.replace("{" + name + "}", values[name])
    return word


class Backoff:
    """Waits longer before each restart, and gives up where there were too many."""

    def __init__(self) -> None:
        self._at_s: deque[float] = deque(maxlen=MANY + 1)

    def delay_s(self, now_s: float, *, is_own: bool = True) -> float | None:
        """Note that the process ended, and return how long to wait; None where it is given up.

        Args:
            now_s: when.
            is_own: it ended by itself; False where another one that it needs did, whose restarts are counted there.
        """
        if is_own:
            self._at_s.append(now_s)
        n = sum(now_s - at_s <= WITHIN_S for at_s in self._at_s)
        return None if n > MANY else min(MOST_S, FIRST_S * 2 ** max(0, n - 1))


def is_own_end(kind: str, now_s: float, ended_s: float | None) -> bool:
    """Tell whether a process's end is its own, and not that of one that it needs.

    Whoever commands the arm ends with an error where the robot node, the hub or the eyes are away: a robot node that
    was killed a few times used up the learner's restarts, and the learner was given up for it.

    Args:
        kind: of the process.
        now_s: when it ended.
        ended_s: when one that the job needs ended or fell silent last; None where none did.
    """
    return kind != JOB or ended_s is None or now_s - ended_s > BLAMED_S
