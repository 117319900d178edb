"""The report: a page and tables, made from the parts."""
