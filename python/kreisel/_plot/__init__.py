"""Pictures by matplotlib. The functions do not use pyplot, so its global state is unchanged."""
