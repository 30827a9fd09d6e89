"""What can go wrong between this machine and a robot's body: each with one line that says what and what helps."""

from crcolony.errors import CrcolonyError


class DeviceError(CrcolonyError):
    """A device is missing, refuses us, or is not what it should be: a person has to do something."""


class DeviceLostError(Exception):
    """A device that was there does not answer any more; it may come back by itself."""
