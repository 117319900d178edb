"""Figures as SVG: lines, distributions, heat maps and spheres, independent of the report."""
