"""The verbs that run a scene: solve, runs, closed forms, and the choice of a geometric method."""
