"""The report: a page and its tables, made of the parts."""
