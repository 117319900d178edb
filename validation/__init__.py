"""The validation of kreisel: truths by heyoka in 128 bit, peers, and the report of error against run time."""
