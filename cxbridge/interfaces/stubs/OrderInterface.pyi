"""The interface type OrderInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.instance import Interface

class OrderInterface(Interface):
    """The interface type OrderInterface.

    An order of a game of production; see GameInterface.
    """

    number: int
    """Its number, from 1; 0: nobody knows it yet."""

    product: str
    """What is to be delivered, in the words of the game."""

    begin: float
    """The second of the production from which on it may be delivered in time."""

    end: float
    """The second until which it is in time."""

    delivered: float
    """The second at which it was delivered; 0: it was not."""

    points: int
    """The points that it has brought."""

    reason: str
    """What they are for, in words."""
