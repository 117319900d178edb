"""A numbered figure of the thesis, redrawn."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    number: str
    title: str
    pictures: list  # as SVG
    caption: str  # the computed result
    rows: tuple = ()  # of a table
