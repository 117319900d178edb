"""What is asked for, checked before anything runs: methods, quantities, times, and the plan."""
