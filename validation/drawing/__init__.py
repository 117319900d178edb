"""Figures in SVG: line charts, distributions, heat maps and spheres."""
