"""Pictures with matplotlib, which is imported here alone, and never its pyplot: no state is left
behind."""
