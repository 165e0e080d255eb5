"""Parts of an account as they come, out of order, twice or never, put into their order. State."""

from collections.abc import Iterator

from robot.bus.account_rows import AccountPart

__all__ = ["AccountOrder"]

MOST_AHEAD = 4096
"""Parts that wait for one that is missing; then it is given up."""


class AccountOrder:
    """Hands on one account's parts in their order, each once.

    Attributes:
        account: whose parts these are; 0 before the first.
        number: of the newest part that was handed on; -1 where none was.
        n_missed: Parts that will never come.
    """

    def __init__(self) -> None:
        self.account, self.number, self.n_missed = 0, -1, 0
        self._is_begun = False
        self._ahead: dict[int, AccountPart] = {}

    def take(self, part: AccountPart) -> Iterator[AccountPart]:
        """Yield what may be written now. A new account begins at the oldest part that can still be told."""
        if part.account != self.account:
            self.account, self._ahead = part.account, {}
            self._is_begun = False
        if not self._is_begun:
            self._is_begun, self.number = True, part.oldest - 1
        if part.number > self.number:
            self._ahead[part.number] = part
        if part.oldest > self.number + 1:  # the teller has no more of them
            yield from self._past(part.oldest)
        if len(self._ahead) > MOST_AHEAD:
            yield from self._past(min(self._ahead))
        while (following := self._ahead.pop(self.number + 1, None)) is not None:
            self.number = following.number
            yield following

    def _past(self, following: int) -> Iterator[AccountPart]:
        """Give up what is missing before a number, and yield what has come of that stretch."""
        for number in sorted(number for number in self._ahead if number < following):
            self.n_missed += number - self.number - 1
            self.number = number
            yield self._ahead.pop(number)
        self.n_missed += following - self.number - 1
        self.number = following - 1
