"""Programs that kreisel is compared with, timing, and the machine."""
