"""What is wrong with a deployment: an inventory, or what it names."""

from crcolony.errors import CrcolonyError


class DeployError(CrcolonyError):
    """Something that a deployment needs is missing or wrong; the message says what, where, and why."""
