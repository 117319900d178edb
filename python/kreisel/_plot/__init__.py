"""Pictures with matplotlib, without its pyplot, so that no state is left behind."""
