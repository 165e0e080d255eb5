"""What an arm that is off its twin looks like: weight that nobody told of, a joint that drags, more lag. Maths.

Joints are off by torque over stiffness: by the weight's pull on each, by dry friction against the way that it goes, as
soon as its servo lets it, and by their speed times what they lag more. These are fitted together to the last seconds,
so that what one of them explains is not taken for another.
"""

from collections import deque
from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

__all__ = ["Cause", "Causes"]

Array = NDArray[np.float64]
WINDOW_S, EVERY_S = 6.0, 0.02
MOVING_RAD_S = 0.03
"""Slower joints may stick: what they are off says nothing of friction."""
GRAVITY_M_S2 = 9.81
LASTING_S = 0.1
"""Errors so far apart count as independent."""
SURE = 5.0
LEAST_ROWS = 60
LEAST_KG, LEAST_S = 0.15, 0.01
"""Less than this is not named: a wire takes some milliseconds."""
LEAST_NM = (1.5, 1.5, 1.5, 0.5, 0.5, 0.5)
SHARE_OF_LOAD = 0.15
"""Friction grows with what a joint carries, and what a payload does to inertia looks like a little of it."""
N_CAUSES = 13


class Cause(msgspec.Struct, frozen=True, kw_only=True):
    """One thing that would explain it."""

    kind: str
    """`payload`, `friction` or `lag`."""
    joint: str = ""
    amount: float
    """More than the twin has: kg, Nm or s."""
    half: float
    """Of a 95 % interval."""

    @property
    def text(self) -> str:
        """In words."""
        size = f"{abs(self.amount):.2f} ± {self.half:.2f}"
        if self.kind == "payload" and self.amount > 0.0:
            return f"{size} kg more hangs in the hand than the twin knows of: was a payload not set?"
        if self.kind == "payload":
            return f"{size} kg less hangs in the hand than the twin knows of: was a payload set that is not there?"
        if self.kind == "friction":
            how = "more" if self.amount > 0.0 else "less"
            return f"joint {self.joint} drags: {size} Nm {how} friction than the twin's"
        how = "more" if self.amount > 0.0 else "less"
        size = f"{1e3 * abs(self.amount):.1f} ± {1e3 * self.half:.1f}"
        return f"joint {self.joint} trails by {size} ms {how} than the twin's"


class Causes:
    """Remembers the last seconds, and names what explains them.

    Args:
        names: of the joints.
        stiffness_nm_rad: of the twin's servos.  (6,)
        servo_s: how long these take.
        tick_s: between two calls.
    """

    def __init__(
        self, names: Sequence[str], stiffness_nm_rad: Sequence[float], *, servo_s: float, tick_s: float
    ) -> None:
        self._names, self._stiffness = tuple(names), np.array(stiffness_nm_rad)
        self._every = max(1, round(EVERY_S / tick_s))
        self._dt_s = self._every * tick_s
        self._rows: deque[Array] = deque(maxlen=round(WINDOW_S / self._dt_s))
        self._share = tick_s / (tick_s + servo_s)
        self._sense = np.zeros(6)
        self._n = 0

    def forget(self) -> None:
        """Begin anew: the arm was placed, stopped, or touches something."""
        self._rows.clear()

    @property
    def is_due(self) -> bool:
        """Whether the next tick is one that is looked at."""
        return (self._n + 1) % self._every == 0

    def take(self, off_rad: Array, qd_rad_s: Array, lift_m: Array | None) -> None:
        """Take note of a tick.

        Args:
            off_rad: (6,) measured less the twin's joints.
            qd_rad_s: (6,) the twin's speeds.
            lift_m: (6,) how much the load rises by each joint's turn (m/rad); None where it is not due.
        """
        self._n += 1
        moving = np.abs(qd_rad_s) > MOVING_RAD_S
        self._sense += np.where(moving, self._share * (np.sign(qd_rad_s) - self._sense), 0.0)
        if self._n % self._every == 0 and lift_m is not None:
            self._rows.append(np.stack([off_rad, qd_rad_s, lift_m, self._sense]))

    def named(self) -> tuple[Cause, ...]:
        """Return what is surely there, the most certain first; nothing where the arm has hardly moved."""
        if len(self._rows) < LEAST_ROWS:
            return ()
        off, qd, lift, sense = np.moveaxis(np.array(self._rows), 1, 0)
        design, target = self._equations(off, qd, lift, sense)
        if len(target) < LEAST_ROWS:
            return ()
        return tuple(sorted(self._sure(design, target), key=lambda cause: cause.half / abs(cause.amount)))

    def _equations(self, off: Array, qd: Array, lift: Array, sense: Array) -> tuple[Array, Array]:
        """Return one equation for each joint that moves at each time, in torque.  (n, 6) x 4 -> (m, 13), (m,)"""
        moving = np.abs(qd) > MOVING_RAD_S
        at, joint = np.nonzero(moving)
        design = np.zeros((len(at), N_CAUSES))
        stiffness = self._stiffness[joint]
        design[:, 0] = -GRAVITY_M_S2 * lift[at, joint]
        design[np.arange(len(at)), 1 + joint] = -sense[at, joint]
        design[np.arange(len(at)), 7 + joint] = -qd[at, joint] * stiffness
        return design, off[at, joint] * stiffness

    def _sure(self, design: Array, target: Array) -> list[Cause]:
        # Joints of little stiffness are as exact in angle as the others: weigh torques by what is left of each joint.
        scale = np.maximum(np.linalg.norm(design, axis=0), 1e-12)
        scaled = design / scale
        information = scaled.T @ scaled + 1e-9 * np.eye(N_CAUSES)
        found = np.linalg.solve(information, scaled.T @ target)
        left = target - scaled @ found
        lasting = max(1.0, LASTING_S / self._dt_s)
        variance = float(left @ left) / max(1.0, len(target) - N_CAUSES) * lasting
        spread = np.sqrt(variance * np.diag(np.linalg.inv(information))) / scale
        amounts = found / scale
        least = self._least(float(abs(amounts[0])), design)
        return [
            self._cause(k, float(amounts[k]), float(1.96 * spread[k]))
            for k in range(N_CAUSES)
            if abs(amounts[k]) > max(least[k], SURE * spread[k])
        ]

    def _least(self, payload_kg: float, design: Array) -> Array:
        pull_nm = payload_kg * np.abs(design[:, 0]).max()
        friction = np.array(LEAST_NM) + SHARE_OF_LOAD * pull_nm * (self._stiffness / self._stiffness.max())
        return np.concatenate([[LEAST_KG], friction, np.full(6, LEAST_S)])

    def _cause(self, k: int, amount: float, half: float) -> Cause:
        if k == 0:
            return Cause(kind="payload", amount=amount, half=half)
        kind, joint = ("friction", k - 1) if k < 7 else ("lag", k - 7)
        return Cause(kind=kind, joint=self._names[joint], amount=amount, half=half)
