"""What of a reading is the plant's doing and no controller's, limit by limit, with its reason."""

import msgspec

__all__ = ["Allowances"]

ROUNDING = 1e-3


class Allowances(msgspec.Struct, frozen=True, kw_only=True):
    """Shares of a limit that the truth may be beyond it before a reading counts as broken."""

    by_limit: dict[str, float] = msgspec.field(default_factory=dict)
    otherwise: float = ROUNDING

    def of(self, limit: str) -> float:
        """Return a limit's allowance; that of `box` holds for every `box:NAME`."""
        return self.by_limit.get(limit, self.by_limit.get(limit.split(":", 1)[0], self.otherwise))
