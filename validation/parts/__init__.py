"""The parts of the report, with their computations, figures and conclusions."""
