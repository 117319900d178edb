"""What is read from a path, or measured over several."""
