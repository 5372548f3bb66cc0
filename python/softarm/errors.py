"""What the package raises beyond ValueError and RuntimeError."""


class ConfigError(ValueError):
    """A faulty configuration. str() has all of its parts: file, line (0: none), key, expected, got."""

    def __init__(self, message, file, line, key, expected, got):
        super().__init__(message)
        self.file = file
        self.line = line
        self.key = key
        self.expected = expected
        self.got = got
