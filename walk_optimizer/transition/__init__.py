"""Steps that lead from one gait to another, from standing into a gait, and from a gait to standing.

Each is solved as accurately as a refined gait, begins and ends exactly where the gaits do, and has a
certificate of its own (docs/transitions.md).
"""
