"""The gripper behind port 63352: registers in, the twin's fingers out. A stop of the robot does not touch it.

Without the tool's power it is dead: its fingers stand, what is asked is lost, and it comes back reset.
"""

from collections.abc import Callable

import msgspec

from sim_twin.controller.wire import GripperMeasurement, GripperRequest
from sim_twin.plant import HELD_GAP_M, STILL_M_S, TwinWorld

__all__ = ["Hand"]

SHUT = 255
RESET, ACTIVATING, ACTIVE = 0, 1, 3
MOVING, HELD_OPENING, HELD_CLOSING, THERE = 0, 1, 2, 3
NOT_ACTIVATED = 7
N_SETTLED = 10
THERE_M = 0.002


class Hand:
    """wire.GripperTarget on the twin's fingers; its activation strokes fully open and fully shut.

    Args:
        world: The twin.
        is_powered: Whether the tool has power now.
    """

    def __init__(self, world: TwinWorld, *, is_powered: Callable[[], bool]) -> None:
        self._world, self._tool = world, world.arm.tool
        self._is_powered = is_powered
        self._request = GripperRequest()
        self._status = RESET
        self._strokes: list[float] = []
        self._n_still = 0
        self._held = MOVING
        data = world.data
        self._fingers = [data.qpos[a : a + 1] for a in world.finger_addresses]
        dofs = [int(world.model.joint(f"finger_{side}").dofadr[0]) for side in ("left", "right")]
        self._speeds = [data.qvel[d : d + 1] for d in dofs]

    @property
    def opening_m(self) -> float:
        """How far the fingers are apart."""
        return self._fingers[0].item() + self._fingers[1].item()

    @property
    def requested(self) -> GripperRequest:
        """Its registers."""
        return self._request

    def request(self, request: GripperRequest) -> None:
        """Take new registers, unless it has no power."""
        if not self._is_powered():
            return
        was_active = bool(self._request.act)
        self._request = request
        if not request.act:
            self._status, self._strokes = RESET, []
            self._stand()
        elif not was_active:
            self._status, self._strokes = ACTIVATING, [self._tool.stroke_m, 0.0]
            self._drive_to(self._strokes[0], speed=SHUT, force=0)
        elif self._status == ACTIVE:
            self._go()
        self._n_still = 0

    def open(self) -> None:
        """Stand open, as after a reset of the table. An active gripper stays active.

        An activation under way is over and done: its strokes would go on over a table that they were not begun on.
        """
        if self._status == ACTIVATING:
            self._status, self._strokes = ACTIVE, []
        self._request = msgspec.structs.replace(self._request, pos=0)
        self._n_still, self._held = 0, MOVING
        self._world.opening_goal_m = self._tool.stroke_m

    def measure(self) -> GripperMeasurement:
        """Return what the gripper reports."""
        stroke = self._tool.stroke_m
        position = round((1.0 - self.opening_m / stroke) * SHUT)
        return GripperMeasurement(
            pos=min(max(position, 0), SHUT),
            pre=self._request.pos,
            sta=self._status,
            obj=self._object(),
            flt=NOT_ACTIVATED if self._request.gto and not self._request.act else 0,
            is_powered=self._is_powered(),
        )

    def tick(self) -> None:
        """Let one slice pass: the activation goes on when a stroke has come to its end."""
        if not self._is_powered():
            self._lose_power()
        speed = abs(self._speeds[0].item() + self._speeds[1].item())
        self._n_still = self._n_still + 1 if speed < STILL_M_S else 0
        self._held = self._holding()
        if self._status != ACTIVATING or self._n_still < N_SETTLED:
            return
        self._strokes = self._strokes[1:]
        self._n_still = 0
        if self._strokes:
            self._drive_to(self._strokes[0], speed=SHUT, force=0)
        else:
            self._status = ACTIVE
            self._go()

    def _lose_power(self) -> None:
        if self._request != GripperRequest():
            self._stand()
        self._request, self._status, self._strokes = GripperRequest(), RESET, []

    def _go(self) -> None:
        request = self._request
        if request.atr:
            self._drive_to(self._tool.stroke_m if request.ard else 0.0, speed=0, force=0)
        elif request.gto:
            self._drive_to((1.0 - request.pos / SHUT) * self._tool.stroke_m, speed=request.spe, force=request.force)
        else:
            self._stand()

    def _stand(self) -> None:
        self._world.opening_goal_m = self._world.opening_asked_m

    def _drive_to(self, opening_m: float, *, speed: int, force: int) -> None:
        world, tool = self._world, self._tool
        world.opening_goal_m = opening_m
        slowest, fastest = tool.speed_m_s
        world.grip_speed_m_s = slowest + (fastest - slowest) * speed / SHUT
        weakest, strongest = tool.force_n
        world.limit_grip(weakest + (strongest - weakest) * force / SHUT)

    def _holding(self) -> int:
        """Return whether something keeps the fingers from where they are asked to be; a short stir loses nothing."""
        off_m = self.opening_m - self._world.opening_asked_m
        if self.opening_m <= HELD_GAP_M or abs(off_m) <= HELD_GAP_M:
            return MOVING
        found = HELD_CLOSING if off_m > 0.0 else HELD_OPENING
        return found if self._n_still or self._held == found else MOVING

    def _object(self) -> int:
        if self._held != MOVING or self._status != ACTIVE:
            return self._held or THERE
        is_there = abs(self._world.opening_goal_m - self._world.opening_asked_m) < THERE_M and self._n_still
        return THERE if is_there else MOVING
