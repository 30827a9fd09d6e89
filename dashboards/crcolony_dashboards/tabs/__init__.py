"""The tabs of the dashboard and how they look."""
