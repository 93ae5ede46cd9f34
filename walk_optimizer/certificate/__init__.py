"""Certificates of both grids: residuals in plain NumPy and torques replayed, apart from the solver."""
