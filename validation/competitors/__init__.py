"""What kreisel is measured beside, how, and on what machine."""
