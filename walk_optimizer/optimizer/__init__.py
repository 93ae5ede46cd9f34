"""From a request to a gait: the search on the report's grid, its refinement, and the whole table."""

from walk_optimizer.optimizer.pipeline import Outcome, optimize, with_continuation

__all__ = ["Outcome", "optimize", "with_continuation"]
