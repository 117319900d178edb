"""What all rooms stand on: arguments, refusals, and axes to draw in."""
