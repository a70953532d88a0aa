"""The interfaces of games, and the tables to which plug-ins add kinds of games.

A kind of game is a group of command line options: if its options select a game, ``cxbridge game`` plays, or
``cxbridge explore`` explores, that game in place of a scenario.
"""

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
    def run_options(self) -> RunOptions:
        """The options of the run, such as its agent and recordings."""

    @property
    def quiet_components(self) -> Collection[str]:
        """The components whose log lines are shown only with ``--verbose``."""

    def replace_agent(self, agent: Path) -> Self:
        """Return the same game with another agent, the agent of ``--against``.

        :raises CxbridgeError: if the options of that agent contradict each other.
        """

    def play(
        self, seed: int, console: Sink | None = None, attach: Callable[[Run], None] | None = None
    ) -> GameResult:
        """Play the game.

        :param seed: the seed of all draws.
        :param console: a sink for log lines; None: the log lines are not shown.
        :param attach: called with each agent before the game; None: nothing is called.
        :raises CxbridgeError: if the game is invalid.
        """


class PluginGameOptions(Protocol):
    """A dataclass of options for a kind of game that is not a scenario."""

    @property
    def is_chosen(self) -> bool:
        """Whether the options select a game."""

    def refuse_game_options(self) -> None:
        """Refuse options that have no meaning without a game; called if no option selects a game.

        :raises CxbridgeError: if such an option is set; the hint names the option that selects a game.
        """


class PlayedGameOptions(PluginGameOptions, Protocol):
    """Options with which ``cxbridge game`` plays a game."""

    def make_game(self, run_options: RunOptions, *, minutes: float | None, world: Path | None) -> Game:
        """Make the game.

        :param run_options: the options of the run, such as its agent and recordings.
        :param minutes: the duration of the production; None for the game's default.
        :param world: the file of possible events; None for the game's default.
        """


class ExploredGameOptions(PluginGameOptions, Protocol):
    """Options with which ``cxbridge explore`` explores a game."""

    def prepare_exploration(self, options: RunOptions) -> tuple[RunOptions, MakeAssembly]:
        """Return the options of a run with a time limit, and the function that makes the run."""


# The groups of options that implement `PlayedGameOptions`.
PLAYED_GAMES: Final[Table[type[Any]]] = Table("PLAYED_GAMES", is_dataclass, "a dataclass of options")

# The groups of options that implement `ExploredGameOptions`.
EXPLORED_GAMES: Final[Table[type[Any]]] = Table("EXPLORED_GAMES", is_dataclass, "a dataclass of options")

GameOptionsT = TypeVar("GameOptionsT", bound=PluginGameOptions)


def load_game_options(table: Table[type[Any]]) -> list[type[Any]]:
    """Return the groups of options in a table."""
    return [table.load_target(row) for row in table.rows]


def find_chosen_game(groups: Sequence[GameOptionsT]) -> GameOptionsT | None:
    """Return the group of options that selects a game, or None.

    :param groups: the groups of which the command line has an option.
    :raises CxbridgeError: if several groups select a game, or an option has no meaning without a game.
    """
    chosen_groups = [group for group in groups if group.is_chosen]
    if len(chosen_groups) > 1:
        names = " and ".join(type(group).__name__ for group in chosen_groups)
        raise CxbridgeError(f"the options name several games: {names}", hint="keep the options of one game")
    if not chosen_groups:
        for group in groups:
            group.refuse_game_options()
    return next(iter(chosen_groups), None)
