"""Models of tops (bodies, scenes and ensembles), and their input and output in TOML."""
