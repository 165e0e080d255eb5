"""The one error of this package: a file is wrong, fix it and start again."""

__all__ = ["ConfigError"]


class ConfigError(ValueError):
    """A config file is missing or wrong. Says in one line: file, path in it, what was expected, what came."""

    def __init__(self, file: str, where: str, expected: str, got: str) -> None:
        self.file = file
        self.where = where
        """Path inside the file such as `boxes[1].lid.output`; empty for the file as a whole."""
        self.expected = expected
        self.got = got
        place = f"{file}: {where}" if where else file
        super().__init__(" ".join(f"{place}: expected {expected}, got {got}".split()))
