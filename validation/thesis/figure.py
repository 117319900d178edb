"""A numbered figure of the thesis, drawn again."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    number: str
    title: str
    pictures: list  # as SVG
    caption: str  # what is true
    rows: tuple = ()  # of a table
