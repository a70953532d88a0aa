"""The interface type HeartbeatInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.instance import Interface

class HeartbeatInterface(Interface):
    """The interface type HeartbeatInterface.

    A sign of life of a client on another machine.
    """

    alive: bool
    """Whether the client is there."""
