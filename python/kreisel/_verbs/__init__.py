"""What a user calls to move a scene: solve, runs, closed forms, and a method chosen for him."""
