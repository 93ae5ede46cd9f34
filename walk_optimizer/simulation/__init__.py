"""Walking: gaits in closed loop over many steps, on a walker that is integrated apart from the optimiser."""
