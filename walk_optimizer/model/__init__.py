"""The planar walker: its parameters, kinematics and Hamiltonian dynamics; nothing of optimisation."""
