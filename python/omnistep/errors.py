"""The exceptions of omnistep: each message is one line that names the error, its place, and the allowed values."""

from omnistep._omnistep import shortened

# Longer messages hold a value too long to be read to its end. What the compiled part says is cut there, value by value.
_MOST = 400


class OmnistepError(Exception):
    """Base class of all exceptions of omnistep.

    Attributes:
        key: the key or argument concerned, such as ``wheel[2].radius_m``; None where there is none.
        file: the file concerned, or ``built-in NAME``; None where there is none.
    """

    def __init__(self, message: str, *, key: str | None = None, file: str | None = None) -> None:
        super().__init__(message if len(message) <= _MOST else shortened(message))
        self.key = key
        self.file = file


class ConfigError(OmnistepError, ValueError):
    """A name, key, value or argument is wrong, or a scenario cannot be read. Nothing was run."""


class SimulationError(OmnistepError):
    """The physics diverged (a value is not finite), or a user's controller returned no valid torques."""


class LogError(OmnistepError, OSError):
    """A log could not be written or read: it is missing, damaged, or not a log of omnistep."""


class StudyError(OmnistepError, OSError):
    """A folder of results could not be read or written, workers do not share it, or a search found no result."""


class NoRouteError(OmnistepError):
    """No route leads to the goal; the message says which edge or obstacle is in the way."""


class VideoError(OmnistepError, RuntimeError):
    """The viewer that makes videos did not start, or ended early."""
