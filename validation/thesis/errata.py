"""Errata of the thesis, with the numerical errors of the printed text and of the correction."""

import tomllib
from pathlib import Path

from . import errata_maps, errata_mechanics

DATA = Path(__file__).with_suffix(".toml")
MODULES = {"errata_maps": errata_maps, "errata_mechanics": errata_mechanics}


def compute_errata():
    """Return the rows of errata.toml, in the order of their numbers, with both errors computed."""
    errata = tomllib.loads(DATA.read_text(encoding="utf-8"))["errata"]
    for number, erratum in enumerate(errata, 1):
        module, name = erratum["errors"].split(".")
        printed, corrected = map(float, getattr(MODULES[module], name)())
        erratum.update(number=number, printed_error=printed, corrected_error=corrected)
    return errata
