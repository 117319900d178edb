"""Pictures by matplotlib. They do not use pyplot, so its global state is unchanged."""
