"""Figures of the thesis, redrawn."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    number: str
    title: str
    pictures: list  # drawings in SVG
    caption: str  # describes the computed result
    rows: tuple = ()  # rows of a table
