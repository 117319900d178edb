"""The validation of kreisel: truths, peers, and the report of error against run time."""
