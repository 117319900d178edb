"""The command-line program, run as `python -m kreisel`."""

from ._cli import main

main(prog_name="kreisel")
