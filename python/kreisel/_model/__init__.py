"""Models of tops: bodies, scenes and ensembles, and their TOML."""
