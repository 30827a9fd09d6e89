"""A robot written from PROTOCOL.md alone: nothing here imports anything of the colony."""
