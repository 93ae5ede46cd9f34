"""The parameter that says which walker a node is for."""

from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.nodes.parameters import Setting
from walk_optimizer.nodes.paths import named_path


def walker_of(path: str) -> WalkerParameters:
    """Return the walker of a YAML file; the packaged one for an empty path.

    Raises:
        ConfigurationError: the file can't be read, or has an impossible entry.
    """
    return WalkerParameters.from_yaml(named_path(path) if path else None)


WALKER_FILE = Setting(
    "walker_file",
    "",
    "YAML file with the walker's parameters; empty for the packaged config/walker.yaml.",
    read_only=True,
    check=walker_of,
)
