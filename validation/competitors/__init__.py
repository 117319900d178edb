"""Programs that kreisel is compared with, timing, and a description of the machine."""
