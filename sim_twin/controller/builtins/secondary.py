"""What a secondary program cannot use: a `sec` runs beside the one that moves the arm, and moves nothing itself."""

from sim_twin.controller.script import Builtin, Builtins, ScriptRuntimeError, Value

__all__ = ["MOVING", "without_motion"]

MOVING = frozenset({
    "movej", "movel", "movep", "movec", "servoc", "optimovej", "optimovel",
    "servoj", "speedj", "speedl", "stopj", "stopl", "direct_torque",
    "force_mode", "end_force_mode",
    "freedrive_mode", "end_freedrive_mode", "teach_mode", "end_teach_mode",
})  # fmt: skip
"""Functions that move the arm, let it be moved, or end what does."""


def without_motion(builtins: Builtins) -> Builtins:
    """Return the functions with those that move refused, so that calling one ends the program and does nothing else."""
    return {name: _refused(name) if name in MOVING else call for name, call in builtins.items()}


def _refused(name: str) -> Builtin:
    def refuse(*_: Value, **__: Value) -> Value:
        raise ScriptRuntimeError(
            f"{name}(): a secondary program may not move the arm: no motion, force mode, freedrive or torque in a sec"
        )

    return refuse
