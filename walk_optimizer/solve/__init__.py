"""Solvers: settings, status, back ends, worker process. Solves any nonlinear program, knows no walker."""
