"""Options of the verbs, validated before anything runs: methods, quantities, times and the plan."""
