"""Multifrontal factorisation of the optimiser's KKT matrices, in C, for IPOPT to load."""
