"""Charts drawn with matplotlib, without changing the global state of pyplot."""
