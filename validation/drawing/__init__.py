"""Pictures as SVG: lines, distributions, heat maps and spheres, which know no part of the
report."""
