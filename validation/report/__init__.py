"""The report: an HTML page and tables, generated from the parts."""
