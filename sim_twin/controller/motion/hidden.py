"""What of an arm is not as its controller believes: weight on the flange, joints that drag, servos of other gains."""

from collections.abc import Sequence

import mujoco

from sim_twin.controller.motion.poses import Array, vec6
from sim_twin.fitted import SOLVED

__all__ = ["Hidden"]


class Hidden:
    """The physics as it was built, and how it differs from that.

    Args:
        model: the twin's; changed in place.
        controls: the joints' actuators.

    Attributes:
        friction_nm: Dry friction of joints whose brakes are open.  (6,)
        gains: The servos' gains, as MuJoCo has them, while they have power.
        biases: Likewise.
    """

    def __init__(self, model: mujoco.MjModel, controls: Array) -> None:
        self._model, self._controls = model, controls
        self._tool = tool = model.body("tool").id
        self._mass, self._compensated = float(model.body_mass[tool]), float(model.body_gravcomp[tool])
        self._inertia = model.body_inertia[tool].copy()
        self.friction_nm = model.dof_frictionloss[:6].copy()
        self._built = (model.actuator_gainprm[controls].copy(), model.actuator_biasprm[controls].copy())
        self.gains, self.biases = self._built

    def carry(self, extra_kg: float) -> None:
        """Let so much more hang at the tool's centre of mass (kg): what carries the tool's weight does not carry it."""
        model, tool, share = self._model, self._tool, (self._mass + extra_kg) / self._mass
        model.body_mass[tool] = self._mass * share
        model.body_inertia[tool] = self._inertia * share
        model.body_gravcomp[tool] = self._compensated / share
        mujoco.mj_setConst(model, mujoco.MjData(model))

    def drag(self, dry_nm: Sequence[float] | Array, viscous_nm_s: Sequence[float] | Array) -> None:
        """Let joints be held back, by so much whenever they move and by so much more at 1 rad/s.  (6,), (6,)

        Raises:
            ValueError: not six finite numbers, or below zero.
        """
        dry, viscous = vec6(dry_nm, "friction"), vec6(viscous_nm_s, "friction")
        if (dry < 0.0).any() or (viscous < 0.0).any():
            raise ValueError(f"friction: expected nothing below 0, got {dry.tolist()} and {viscous.tolist()}")
        self.friction_nm = dry
        if dry.any():
            self._model.opt.tolerance, self._model.opt.iterations = SOLVED
        self._model.dof_damping[:6] = viscous

    def retune(self, stiffness: float, damping: float) -> None:
        """Let the servos be so many times as stiff and as damped as they were built."""
        gains, biases = self._built
        self.gains, self.biases = gains * stiffness, biases.copy()
        self.biases[:, 1] *= stiffness
        self.biases[:, 2] *= damping
