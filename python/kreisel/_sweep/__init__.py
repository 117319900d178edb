"""Sweeps: many tops in parts on the disk, each made by whoever is free, none of them twice."""
