"""The fixtures that start nodes as processes, for faults of every kind."""

from nodes.conftest import (  # noqa: F401
    graph,
    isolated_graph,
    other_walker,
    start,
    start_for_module,
    stocked,
)
