"""What moves: bodies and scenes, and their TOML."""
