"""The exceptions of walk_optimizer: one base class, one subclass for each kind of fault."""

_LONGEST = 100


def quoted(value: object) -> str:
    """Return a value in quotes, as messages show what they got; of a long one the middle is left out."""
    try:
        return shortened(repr(value))
    except ValueError:
        # Python writes no whole number of more than some thousand digits.
        return "a number of too many digits"


def shortened(text: str) -> str:
    """Return a text of about a line; of a longer one the middle is left out."""
    left_out = len(text) - _LONGEST
    if left_out <= 0:
        return text
    half = _LONGEST // 2
    return f"{text[:half]}... {left_out} characters ...{text[-half:]}"


class WalkOptimizerError(Exception):
    """Base class of every error that this package raises on purpose."""


class InvalidRequestError(WalkOptimizerError, ValueError):
    """A request that can't be met whatever is computed: refused before any work starts."""


class ConfigurationError(WalkOptimizerError, ValueError):
    """A parameter or settings file with a missing, unknown or impossible entry."""


class SolveFailedError(WalkOptimizerError):
    """A solve ended without a gait; the message names the status and the worst constraint family."""


class GaitFileError(WalkOptimizerError):
    """A gait file that is missing, damaged, of another version or not writable."""


class GaitNotWritableError(GaitFileError):
    """A gait file, or the folder of such files, that can't be written."""


class GaitNotFoundError(WalkOptimizerError, LookupError):
    """The library holds no such gait."""


class MissingDependencyError(WalkOptimizerError, ImportError):
    """An optional dependency is needed for what was asked; the message says which extra to install."""
