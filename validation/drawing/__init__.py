"""Figures in SVG: lines, distributions, heat maps and spheres, independent of the report."""
