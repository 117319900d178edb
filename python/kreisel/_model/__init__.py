"""Models of tops: bodies, scenes and ensembles, with input and output in TOML."""
