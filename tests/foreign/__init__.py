"""A robot written from PROTOCOL.md: nothing here imports anything of the colony."""
