"""Charts drawn with matplotlib, without pyplot, so the global state of pyplot is unchanged."""
