"""What somebody sees: the command line and the page."""
