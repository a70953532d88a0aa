"""The interface type GameStateInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.instance import Interface, Message

class GameStateInterface(Interface):
    """The interface type GameStateInterface.

    How a game of football stands.
    """

    class if_gamestate_team_t(IntEnum):
        """Values of type if_gamestate_team_t.

        A team.
        """

        TEAM_NONE = 0
        """None."""

        TEAM_CYAN = 1
        """The cyan one."""

        TEAM_MAGENTA = 2
        """The magenta one."""

        TEAM_BOTH = 3
        """Both of them."""

    TEAM_NONE: ClassVar[if_gamestate_team_t]
    TEAM_CYAN: ClassVar[if_gamestate_team_t]
    TEAM_MAGENTA: ClassVar[if_gamestate_team_t]
    TEAM_BOTH: ClassVar[if_gamestate_team_t]

    class if_gamestate_goalcolor_t(IntEnum):
        """Values of type if_gamestate_goalcolor_t.

        A goal.
        """

        GOAL_BLUE = 0
        """The blue one."""

        GOAL_YELLOW = 1
        """The yellow one."""

    GOAL_BLUE: ClassVar[if_gamestate_goalcolor_t]
    GOAL_YELLOW: ClassVar[if_gamestate_goalcolor_t]

    class if_gamestate_half_t(IntEnum):
        """Values of type if_gamestate_half_t.

        A part of the game.
        """

        HALF_FIRST = 0
        """Until the break."""

        HALF_SECOND = 1
        """After the break."""

    HALF_FIRST: ClassVar[if_gamestate_half_t]
    HALF_SECOND: ClassVar[if_gamestate_half_t]

    class if_gamestate_role_t(IntEnum):
        """Values of type if_gamestate_role_t.

        The place of a robot in its team.
        """

        ROLE_GOALIE = 0
        """Keeps the goal."""

        ROLE_DEFENDER = 1
        """Defends."""

        ROLE_MID_LEFT = 2
        """Plays in the middle, on the left."""

        ROLE_MID_RIGHT = 3
        """Plays in the middle, on the right."""

        ROLE_ATTACKER = 4
        """Attacks."""

    ROLE_GOALIE: ClassVar[if_gamestate_role_t]
    ROLE_DEFENDER: ClassVar[if_gamestate_role_t]
    ROLE_MID_LEFT: ClassVar[if_gamestate_role_t]
    ROLE_MID_RIGHT: ClassVar[if_gamestate_role_t]
    ROLE_ATTACKER: ClassVar[if_gamestate_role_t]

    GS_FROZEN: ClassVar[int]
    """Nobody may move."""

    GS_PLAY: ClassVar[int]
    """The game goes on."""

    GS_KICK_OFF: ClassVar[int]
    """A kick-off."""

    GS_DROP_BALL: ClassVar[int]
    """The referee drops the ball for both."""

    GS_PENALTY: ClassVar[int]
    """A penalty kick."""

    GS_CORNER_KICK: ClassVar[int]
    """A corner kick."""

    GS_THROW_IN: ClassVar[int]
    """A throw-in."""

    GS_FREE_KICK: ClassVar[int]
    """A free kick."""

    GS_GOAL_KICK: ClassVar[int]
    """A goal kick."""

    GS_HALF_TIME: ClassVar[int]
    """The break."""

    GS_SPL_INITIAL: ClassVar[int]
    """Before everything."""

    GS_SPL_READY: ClassVar[int]
    """The robots take their places."""

    GS_SPL_SET: ClassVar[int]
    """The robots wait for the kick-off."""

    GS_SPL_PLAY: ClassVar[int]
    """The game goes on."""

    GS_SPL_FINISHED: ClassVar[int]
    """A half, or the game, is over."""

    class SetTeamColorMessage(Message):
        """The message SetTeamColorMessage.

        Say which team is the own one.
        """

        our_team: GameStateInterface.if_gamestate_team_t
        """The own team."""

        def __init__(
            self,
            our_team: GameStateInterface.if_gamestate_team_t | int = 0,
        ) -> None: ...

    class SetKickoffMessage(Message):
        """The message SetKickoffMessage.

        Say whether the own team kicks off.
        """

        kickoff: bool
        """Whether the own team kicks off."""

        def __init__(
            self,
            kickoff: bool = False,
        ) -> None: ...

    class SetStateTeamMessage(Message):
        """The message SetStateTeamMessage.

        Say which team the game state is about.
        """

        state_team: GameStateInterface.if_gamestate_team_t
        """The team that game_state is about."""

        def __init__(
            self,
            state_team: GameStateInterface.if_gamestate_team_t | int = 0,
        ) -> None: ...

    game_state: int
    """What is being played: one of the GS_ constants."""

    state_team: if_gamestate_team_t
    """The team that game_state is about."""

    our_team: if_gamestate_team_t
    """The own team."""

    our_goal_color: if_gamestate_goalcolor_t
    """The own goal."""

    half: if_gamestate_half_t
    """The part of the game."""

    kickoff: bool
    """Whether the own team kicks off."""

    role: if_gamestate_role_t
    """The place of this robot in its team."""

    score_cyan: int
    """Goals of the cyan team."""

    score_magenta: int
    """Goals of the magenta team."""
