"""What a step of motion leads to: limits met too fast, a stop that would end outside, and how much of it they leave."""

from robot.chain import ToolChain
from robot.envelope import Envelope
from robot.geometry import stepped, vec6
from robot.messages import Vec6
from robot.motion.holding import (
    MARGIN_M,
    OVERRUN_M,
    REST,
    TIP,
    TIPS,
    Met,
    Place,
    Points,
    brake_share,
    share_at_rest,
    share_left,
    share_of_way,
    stops_outside,
    stretch,
    tips_too_fast,
    too_fast,
)
from robot.motion.swinging import of_swings

__all__ = ["Ahead"]


class Ahead:
    """Looks along the joints' way from one command, tick by tick. Holds no memory but of the call to `met`.

    Args:
        chain: where the parts are.
        envelope: what of the limits profile is held.
        tip_min_m: how low fingertips may go, base frame.
    """

    def __init__(self, chain: ToolChain, envelope: Envelope, *, tip_min_m: float) -> None:
        self._chain, self._envelope, self._tip_min_m = chain, envelope, tip_min_m

    def met(
        self,
        now_rad: Vec6,
        steps: list[float],
        places: tuple[Points, Place, Place],
        past: tuple[Points, Points],
        *,
        is_straight: bool,
    ) -> list[Met]:
        """Return the limits that steps go at too fast. Joints' ways bend: where a stop would end is looked at too.

        Args:
            now_rad: the last command.
            steps: how far each joint would go.
            places: points at the command before the last; points and tilt at the last and where the step leads.
            past: points before and after the step SWING_S ago.
            is_straight: the tool goes straight and slides along its fences.
        """
        envelope, floor_m = self._envelope, self._tip_min_m
        fastest = max(max(steps), -min(steps))
        if fastest <= 0.0:
            return []
        lost = brake_share(fastest, envelope)
        end = self._rest(now_rad, places[1], steps)
        met = stops_outside(end, self._lowest_m(end), floor_m, _least_m(is_straight=is_straight), envelope)
        met += of_swings(places[1][0], places[2][0], past, envelope)
        if is_straight:
            return met + too_fast(now_rad, steps, places, None, lost, envelope)
        heights_m = (self._lowest_m(places[1]), self._lowest_m(places[2]), self._lowest_m(end))
        met += tips_too_fast(heights_m, floor_m, lost, envelope)
        return met + too_fast(now_rad, steps, places, end[0], lost, envelope)

    def left(
        self, met: list[Met], now_rad: Vec6, now: Place, wanted: list[float], base: list[float], *, is_straight: bool
    ) -> tuple[float, str]:
        """Return how much of the way from a braking arm's step to the wanted one limits leave, 0 to 1, and which does.

        Args:
            met: the limits.
            now_rad: the last command.
            now: points and tilt there.
            wanted: the steps that were wanted.
            base: the braking arm's.
            is_straight: the tool goes straight.
        """
        there = self._chain.points(stepped(now_rad, vec6(base), 1.0))
        ends = self._rest(now_rad, now, wanted), self._rest(now_rad, now, base)
        least_m = _least_m(is_straight=is_straight)
        share, name = 1.0, ""
        for limit in met:
            if limit.kind == REST:
                left = share_at_rest(*(self._gap_m(limit.index, end) - least_m for end in ends))
            elif limit.kind == TIP:
                left = share_left(limit, self._lowest_m(now) - self._lowest_m(there))
            else:
                left = share_of_way(limit, base, now, there, self._envelope)
            if left < share:
                share, name = left, limit.name
        return share, name

    def _rest(self, now_rad: Vec6, now: Place, steps: list[float]) -> Place:
        """Return where joints come to rest that take a step and then brake together."""
        fastest = max(max(steps), -min(steps))
        if fastest <= 0.0:
            return now
        far = stretch(brake_share(fastest, self._envelope), self._envelope)
        return self._chain.points(stepped(now_rad, vec6(steps), far))

    def _gap_m(self, index: int, place: Place) -> float:
        """Return what is left of a fence, or of the fingertips' height over the table."""
        if index == TIPS:
            return self._lowest_m(place) - self._tip_min_m
        fence = self._envelope.fences[index]
        return fence.gap(place[0][fence.part])

    def _lowest_m(self, place: Place) -> float:
        return self._chain.lowest_m(place[0][0], place[1])


def _least_m(*, is_straight: bool) -> float:
    """Return the least gap at which a stop ends inside of a fence."""
    return -OVERRUN_M if is_straight else MARGIN_M
