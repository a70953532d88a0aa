"""The games that plug-ins add to `cxbridge game` and `cxbridge explore`."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol, Self, TypeVar

from cxbridge.errors import CxbridgeError
from cxbridge.plugins import Table

if TYPE_CHECKING:
    from cxbridge.events import Sink
    from cxbridge.run.agent import Run
    from cxbridge.run.options import RunOptions
    from cxbridge_explore.game.score import GameResult
    from cxbridge_explore.worlds.run import MakeAssembly


class Game(Protocol):
    """A game that can be played with any seed, in another process, too."""

    @property
    def run(self) -> RunOptions:
        """The options of the run: its agent, and its recordings."""

    @property
    def quiet(self) -> Collection[str]:
        """The components whose log lines are shown with ``--verbose`` only."""

    def of_agent(self, agent: Path) -> Self:
        """Return the same game of another agent: that of ``--against``.

        :raises CxbridgeError: when the options of the other agent contradict each other.
        """

    def play(
        self, seed: int, console: Sink | None = None, attach: Callable[[Run], None] | None = None
    ) -> GameResult:
        """Play the game.

        :param seed: of all that is drawn.
        :param console: gets the log lines.
        :param attach: called with each agent, before it is played.
        :raises CxbridgeError: when the input is bad.
        """


class PlayedGame(Protocol):
    """A group of options of `cxbridge game`, a dataclass, for a kind of game that is not a scenario."""

    @property
    def is_chosen(self) -> bool:
        """Whether the options name a game."""

    def refuse(self) -> None:
        """Refuse the options when they name no game.

        :raises CxbridgeError: with a hint which option names the game.
        """

    def game(self, run: RunOptions, *, minutes: float | None, world: Path | None, several: bool) -> Game:
        """Return the game.

        :param run: the agent, and its recordings.
        :param minutes: of the production; None: the game's own.
        :param world: the file of possible failures.
        :param several: whether several games are played.
        :raises CxbridgeError: when an option is wrong.
        """


class ExploredGame(Protocol):
    """A group of options of `cxbridge explore`, a dataclass, for a kind of game that is not a scenario."""

    @property
    def is_chosen(self) -> bool:
        """Whether the options name a game."""

    def refuse(self) -> None:
        """Refuse the options when they name no game.

        :raises CxbridgeError: with a hint which option names the game.
        """

    def explored(self, options: RunOptions) -> tuple[RunOptions, MakeAssembly]:
        """Return the options of a run that ends with its time, and what makes the run.

        :raises CxbridgeError: when an option is wrong.
        """


PLAYED_GAMES: Final[Table[type[Any]]] = Table("PLAYED_GAMES", is_dataclass, "a dataclass of options")
"""The groups of options that are a :class:`PlayedGame`."""

EXPLORED_GAMES: Final[Table[type[Any]]] = Table("EXPLORED_GAMES", is_dataclass, "a dataclass of options")
"""The groups of options that are an :class:`ExploredGame`."""

T = TypeVar("T", PlayedGame, ExploredGame)


def chosen_game(groups: Sequence[T]) -> T | None:
    """Return the group of options that names a game; None when no option does.

    :param groups: those with an option that was given.
    :raises CxbridgeError: when several name a game, or options are for a game that none names.
    """
    chosen = [group for group in groups if group.is_chosen]
    if len(chosen) > 1:
        names = " and ".join(type(group).__name__ for group in chosen)
        raise CxbridgeError(f"the options name two games: {names}", hint="leave the options of one")
    if not chosen:
        for group in groups:
            group.refuse()
    return chosen[0] if chosen else None
