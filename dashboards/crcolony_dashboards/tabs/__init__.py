"""The pages of the dashboard, one file each, and how they look."""
