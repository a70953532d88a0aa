"""The options of ``cxbridge game``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar

import typer

from cxbridge.run.options import LogOptions, ScenarioOptions, SourceOptions, TraceOptions
from cxbridge_explore.game.kinds import PLAYED_GAMES, PlayedGameOptions, load_game_options


@dataclass(frozen=True, kw_only=True)
class AgentOptions(ScenarioOptions, SourceOptions, TraceOptions, LogOptions):
    """Options of the agent and its recordings."""


@dataclass(frozen=True, kw_only=True)
class PlayOptions:
    """Options of the games and their result."""

    against: Annotated[
        Path | None,
        typer.Option(
            metavar="SCENARIO",
            help="A second agent, which plays with the same seeds. In a game of a plug-in: a folder that is "
            "laid over the folder of the first agent.",
            show_default=False,
        ),
    ] = None
    games: Annotated[
        int, typer.Option(min=1, metavar="N", help="The number of games, each with a different seed.")
    ] = 1
    seed: Annotated[
        int, typer.Option(help="The seed of the first game; each later game has the next number.")
    ] = 0
    minutes: Annotated[
        float | None,
        typer.Option(
            min=0,
            metavar="M",
            help="The duration of the production in minutes; by default the game's own duration.",
            show_default=False,
        ),
    ] = None
    world: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Draw failures from the world in this file; by default from the scenario's world.yaml, "
            "if the scenario has one.",
            show_default=False,
        ),
    ] = None
    jobs: Annotated[
        int, typer.Option(min=0, help="The number of processes for many games; 0: one per processor.")
    ] = 0


@dataclass(frozen=True, kw_only=True)
class GameOptions:
    """Options with which plug-ins select a game in place of a scenario.

    :cvar added_groups: returns the groups of options of plug-ins, which become ``plugin_groups``.
    """

    added_groups: ClassVar[Callable[[], list[type[Any]]]] = partial(load_game_options, PLAYED_GAMES)

    plugin_groups: tuple[PlayedGameOptions, ...] = ()
