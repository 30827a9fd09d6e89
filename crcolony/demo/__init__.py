"""The way of a user in a minute (`crcolony demo`): evolve in one process, then live as processes, with a dashboard."""
