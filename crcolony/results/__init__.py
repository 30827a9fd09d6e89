"""What a run leaves behind: its results folder, tables and histories, reports, inspection and figures."""
