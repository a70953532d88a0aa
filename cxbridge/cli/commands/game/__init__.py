"""`cxbridge game`: play for points, one game or many, one agent or two."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from cxbridge.cli.connect import AsJson
from cxbridge.cli.console import complain, say_json
from cxbridge.cli.console_options import ConsoleOptions
from cxbridge.cli.option_groups import option_groups
from cxbridge.cli.progress import progress
from cxbridge.cli.story import RunLog
from cxbridge.errors import CxbridgeError
from cxbridge.run.options import LogOptions, RunOptions, ScenarioOptions, SourceOptions, TraceOptions

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cxbridge.game.match import Game
    from cxbridge.game.score import GameResult

NOT_OVER: Final = 3
"""Exit status of a game that did not come to its end."""

FAULT: Final = 4


@dataclass(frozen=True, kw_only=True)
class _Agent(ScenarioOptions, SourceOptions, TraceOptions, LogOptions):
    """The agent, and what is recorded."""


@dataclass(frozen=True, kw_only=True)
class _Game:
    """What is played."""

    against: Annotated[
        Path | None,
        typer.Option(metavar="SCENARIO", help="A second agent, on the same seeds.", show_default=False),
    ] = None
    games: Annotated[int, typer.Option(min=1, metavar="N", help="How many games, each with a seed.")] = 1
    seed: Annotated[int, typer.Option(help="The seed of the first game; the others follow.")] = 0
    minutes: Annotated[
        float | None,
        typer.Option(
            min=0,
            metavar="M",
            help="Minutes of the production; as the scenario says by default.",
            show_default=False,
        ),
    ] = None
    world: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="What can fail; world.yaml beside the scenario by default. Without one nothing fails.",
            show_default=False,
        ),
    ] = None
    jobs: Annotated[
        int, typer.Option(min=0, help="Processes for many games; 0: as many as there are processors.")
    ] = 0


@option_groups
def game(agent: _Agent, play: _Game, console: ConsoleOptions, *, as_json: AsJson = False) -> int:
    """Play a game on the virtual clock, and print the score; play many with --games or --against.

    A game is a scenario with a referee that publishes GameInterface. Its orders, and what fails, are drawn by
    the seed: the same seed is the same game.

    Exit status: 0 each game came to its end; 2 bad input; 3 one did not; 4 a fault of a run itself.

    Example: cxbridge game workshop --games 20 --against workshop-2
    """
    from cxbridge.game.scenario import ScenarioGame

    options = RunOptions(**vars(agent), skiller="none")
    options.check()
    first = ScenarioGame(run=options, minutes=play.minutes, world=play.world)
    if play.games == 1 and play.against is None:
        log = RunLog(quiet=console.quiet, verbose=console.verbose)
        return _one(first.play(play.seed, log, log.attach), as_json=as_json)
    games: dict[str, Game] = {str(agent.scenario): first}
    if play.against is not None:
        games[str(play.against)] = replace(first, run=replace(options, scenario=play.against))
        if len(games) == 1:
            raise CxbridgeError(f"--against names the same agent: {play.against}", hint="name another one")
    if options.trace or options.log or options.bblog:
        raise CxbridgeError(
            "many games cannot be recorded to one file", hint="play the one of a seed: --seed N"
        )
    return _many(games, play, as_json=as_json)


def _one(result: GameResult, *, as_json: bool) -> int:
    from cxbridge.cli.commands.game.output import say_game

    if as_json:
        say_json(result.as_dict(), indent=2)
    else:
        say_game(result)
    return _status({result.seed: result})


def _many(games: Mapping[str, Game], play: _Game, *, as_json: bool) -> int:
    from cxbridge.cli.commands.game.output import say_games
    from cxbridge.game.match import GamesSummary, Match, play_games

    seeds = range(play.seed, play.seed + play.games)
    with progress("games", len(seeds) * len(games)) as advance:
        played = play_games(games, seeds, play.jobs or os.cpu_count() or 1, advance)
    if not as_json:
        say_games(played)
    else:
        found = {"agents": {name: GamesSummary(results).as_dict() for name, results in played.items()}}
        if len(played) > 1:
            found["comparison"] = Match(*played.values()).as_dict()
        say_json({**found, "seed": play.seed}, indent=2)
    return max(_status(results) for results in played.values())


def _status(results: Mapping[int, GameResult]) -> int:
    """Tell what went wrong; returns the exit status."""
    for seed, result in results.items():
        for each in result.undefined:
            complain(f"{each}; what it does never happens")
        for fault in result.faults:
            complain(f"seed {seed}: {fault}")
    if any(result.faults for result in results.values()):
        return FAULT
    return 0 if all(result.is_over for result in results.values()) else NOT_OVER
