"""The kinds of games that plug-ins add to ``cxbridge game`` and ``cxbridge explore``."""

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
    """A game that can be played with any seed, also in another process."""

    @property
    def run(self) -> RunOptions:
        """The options of the run, such as its agent and recordings."""

    @property
    def quiet(self) -> Collection[str]:
        """The components whose log lines are shown only with ``--verbose``."""

    def of_agent(self, agent: Path) -> Self:
        """Return the same game with another agent, that of ``--against``.

        :raises CxbridgeError: if the options of that agent contradict each other.
        """

    def play(
        self, seed: int, console: Sink | None = None, attach: Callable[[Run], None] | None = None
    ) -> GameResult:
        """Play the game.

        :param seed: the seed of all draws.
        :param console: a sink for log lines.
        :param attach: called with each agent before the game.
        """


class PlayedGame(Protocol):
    """A dataclass of options for ``cxbridge game``, for a kind of game that is not a scenario."""

    @property
    def is_chosen(self) -> bool:
        """Whether the options select a game."""

    def refuse(self) -> None:
        """Reject options that select no game.

        :raises CxbridgeError: with a hint at the option that selects the game.
        """

    def game(self, run: RunOptions, *, minutes: float | None, world: Path | None, several: bool) -> Game:
        """Return the game.

        :param run: the options of the run, such as its agent and recordings.
        :param minutes: the duration of the production; None for the game's default.
        :param world: the file of possible failures.
        :param several: whether several games are played.
        """


class ExploredGame(Protocol):
    """A dataclass of options for ``cxbridge explore``, for a kind of game that is not a scenario."""

    @property
    def is_chosen(self) -> bool:
        """Whether the options select a game."""

    def refuse(self) -> None:
        """Reject options that select no game.

        :raises CxbridgeError: with a hint at the option that selects the game.
        """

    def explored(self, options: RunOptions) -> tuple[RunOptions, MakeAssembly]:
        """Return the options of a run with a time limit, and the function that makes the run."""


# The groups of options that implement `PlayedGame`.
PLAYED_GAMES: Final[Table[type[Any]]] = Table("PLAYED_GAMES", is_dataclass, "a dataclass of options")

# The groups of options that implement `ExploredGame`.
EXPLORED_GAMES: Final[Table[type[Any]]] = Table("EXPLORED_GAMES", is_dataclass, "a dataclass of options")

T = TypeVar("T", PlayedGame, ExploredGame)


def chosen_game(groups: Sequence[T]) -> T | None:
    """Return the group of options that selects a game, or None.

    :param groups: the groups with a given option.
    :raises CxbridgeError: if several groups select a game, or options are given without their game.
    """
    chosen = [group for group in groups if group.is_chosen]
    if len(chosen) > 1:
        names = " and ".join(type(group).__name__ for group in chosen)
        raise CxbridgeError(f"the options name two games: {names}", hint="leave out the options of one game")
    if not chosen:
        for group in groups:
            group.refuse()
    return chosen[0] if chosen else None
