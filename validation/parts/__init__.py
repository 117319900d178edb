"""The parts of the report: their data, figures and conclusions."""
