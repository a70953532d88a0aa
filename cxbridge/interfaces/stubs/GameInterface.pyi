"""The interface type GameInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.instance import Interface

class GameInterface(Interface):
    """The interface type GameInterface.

    How a game of production stands; the referee writes it.
    """

    class Phase(IntEnum):
        """Values of type Phase.

        How far a game is.
        """

        PRE_GAME = 0
        """It has not begun."""

        PRODUCTION = 1
        """It goes on."""

        POST_GAME = 2
        """It is over."""

    PRE_GAME: ClassVar[Phase]
    PRODUCTION: ClassVar[Phase]
    POST_GAME: ClassVar[Phase]

    phase: Phase
    """How far it is."""

    team: str
    """The team that plays."""

    second: float
    """Seconds since the beginning of the production."""

    orders: int
    """How many orders there are, those included that nobody knows yet."""

    deliveries: int
    """How many orders were delivered."""

    points: int
    """The points of the team."""
