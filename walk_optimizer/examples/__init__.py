"""Problems whose contacts nobody gives: the optimiser finds them by complementarity alone."""
