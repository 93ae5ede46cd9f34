"""Gaits and transitions as work of other processes: made cancellable, and shared by all who ask for them."""
