"""The one error of this package: a file is wrong, fix it and start again."""

__all__ = ["ConfigError"]


class ConfigError(Exception):
    """A config file is missing or wrong. Says in one line: file, path in it, what was expected, what came."""

    def __init__(self, file: str, where: str, expected: str, got: str) -> None:
        super().__init__(file, where, expected, got)
        self.file = file
        self.where = where
        """Path inside the file such as `boxes[1].lid.output`; empty for the file as a whole."""
        self.expected = expected
        self.got = got

    def __str__(self) -> str:
        place = f"{self.file}: {self.where}" if self.where else self.file
        return " ".join(f"{place}: expected {self.expected}, got {self.got}".split())
