"""The HTML page and the tables of the report."""
