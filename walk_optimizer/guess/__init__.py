"""First guesses, and which of them a search tries. Owns where a solve begins; solves nothing."""
