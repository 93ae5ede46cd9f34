"""Grids and problems: turns the walker and a request into a nonlinear program, solves nothing."""
