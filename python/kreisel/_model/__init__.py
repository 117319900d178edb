"""Models of tops (bodies and scenes), and their input and output in TOML."""
