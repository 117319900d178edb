"""python -m kreisel: the command line."""
from .cli import main

main(prog_name="kreisel")
