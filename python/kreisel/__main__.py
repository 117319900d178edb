"""The command line program, as `python -m kreisel`."""

from ._cli import main

main(prog_name="kreisel")
