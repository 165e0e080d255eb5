"""What a secondary program cannot use: a `sec` runs beside the one that moves the arm, and moves nothing itself.

Nor does it touch that program's watchdogs: it could take away what guards the motion.
"""

from sim_twin.controller.script import Builtin, Builtins, ScriptRuntimeError, Value

__all__ = ["GUARDING", "MOVING", "without_motion"]

MOVING = frozenset({
    "movej", "movel", "movep", "movec", "servoc", "optimovej", "optimovel",
    "servoj", "speedj", "speedl", "stopj", "stopl", "direct_torque",
    "force_mode", "end_force_mode",
    "freedrive_mode", "end_freedrive_mode", "teach_mode", "end_teach_mode",
})  # fmt: skip
"""Functions that move the arm, let it be moved, or end what does."""
GUARDING = frozenset({"rtde_set_watchdog"})
"""Functions that change what guards the program which does."""
_NO_MOTION = "a secondary program may not move the arm: no motion, force mode, freedrive or torque in a sec"
_NO_WATCHDOG = "a secondary program has no watchdogs of its own: set them in the program that they are to end"


def without_motion(builtins: Builtins) -> Builtins:
    """Return the functions with those refused, so that calling one ends the program and does nothing else."""
    refused = dict.fromkeys(MOVING, _NO_MOTION) | dict.fromkeys(GUARDING, _NO_WATCHDOG)
    return {name: _refused(name, refused[name]) if name in refused else call for name, call in builtins.items()}


def _refused(name: str, why: str) -> Builtin:
    def refuse(*_: Value, **__: Value) -> Value:
        raise ScriptRuntimeError(f"{name}(): {why}")

    return refuse
