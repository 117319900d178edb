"""python -m kreisel: the command line."""

from ._cli import main

main(prog_name="kreisel")
