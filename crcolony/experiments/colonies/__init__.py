"""Colonies that experiments run, and what they measure of them."""
