"""The nodes of these tests are started as in test/nodes."""

from nodes.conftest import graph, isolated_graph, start_for_module

__all__ = ["graph", "isolated_graph", "start_for_module"]
