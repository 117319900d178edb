"""The report: a page and its tables, made from the parts."""
