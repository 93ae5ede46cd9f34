"""The command line: one verb a file. Owns texts and exit codes; computes nothing."""
