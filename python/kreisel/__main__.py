"""python -m kreisel: the command line."""

from ._showing.cli import main

main(prog_name="kreisel")
