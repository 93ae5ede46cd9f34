"""Speeds that the tests search for in [m/s], slow, middle and fast, each on a grid of its own."""

GRIDS = {0.2353: 25, 0.42: 40, 0.85: 30}
