"""The exceptions of walk_optimizer: one base class, one subclass for each kind of fault."""


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
