"""The command ``cxbridge game``, which plays one or many games, with one or two agents."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.cli.connect import AsJson
from cxbridge.cli.console import ConsoleOptions, complain, progress_line, say_json
from cxbridge.cli.option_groups import option_groups
from cxbridge.cli.run_output import RunLogPrinter
from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, LogLine
from cxbridge.run.options import RunOptions
from cxbridge_explore.cli.game.options import AgentOptions, GameOptions, PlayOptions
from cxbridge_explore.game.kinds import find_chosen_game

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from cxbridge_explore.game.kinds import Game
    from cxbridge_explore.game.score import GameResult

EXIT_TESTS_FAILED: Final = 1  # exit status of a game whose agent's own tests failed

EXIT_NOT_OVER: Final = 3  # exit status of an unfinished game

EXIT_FAULT: Final = 4  # exit status of a game that an error of cxbridge has ended


class _GameLog(RunLogPrinter):
    """Prints the log of a game. Lines of quiet components are printed only with ``--verbose``."""

    def __init__(self, console: ConsoleOptions, quiet_components: Collection[str]) -> None:
        super().__init__(quiet=console.quiet, verbose=console.verbose)
        self._hidden_components = frozenset(() if console.verbose else quiet_components)

    def __call__(self, event: Event) -> None:
        """Print a log line, unless its component is hidden."""
        if not (isinstance(event, LogLine) and event.component in self._hidden_components):
            super().__call__(event)


@option_groups
def game(
    agent_options: AgentOptions,
    play_options: PlayOptions,
    game_options: GameOptions,
    console: ConsoleOptions,
    *,
    as_json: AsJson = False,
) -> int:
    """Play a game on the virtual clock, and print the score; play many games with --games or --against.

    A game is a scenario with a referee that publishes GameInterface, or a game of a plug-in. The seed
    determines the orders and the failures, so the same seed gives the same game. With cxbridge-rcll,
    --refbox-dir plays the RoboCup Logistics League, judged by the referee's own rules.

    Exit status: 0 each game reached its end; 1 the agent's own tests failed; 2 bad input; 3 a game did not
    reach its end; 4 an error of cxbridge itself.

    Example: cxbridge game workshop --games 20 --against workshop-2
    """
    # without a Skiller, since the world of the game decides how skills end
    options = RunOptions(**vars(agent_options), skiller="none")
    first_game = _make_game(options, play_options, game_options)
    if play_options.games == 1 and play_options.against is None:
        log = _GameLog(console, first_game.quiet_components)
        return _report_game(first_game.play(play_options.seed, log, log.attach), as_json=as_json)
    if options.trace or options.log or options.bblog:
        raise CxbridgeError("many games cannot be recorded to one file", hint="play a single game: --seed N")
    return _play_series(_make_games_by_agent(first_game, play_options.against), play_options, as_json=as_json)


def _make_game(options: RunOptions, play_options: PlayOptions, game_options: GameOptions) -> Game:
    """Make the game of the scenario, or the game that options of a plug-in select."""
    from cxbridge_explore.game.scenario import ScenarioGame

    plugin_game = find_chosen_game(game_options.plugin_groups)
    if plugin_game is not None:
        return plugin_game.make_game(options, minutes=play_options.minutes, world=play_options.world)
    options.check()
    return ScenarioGame(run_options=options, minutes=play_options.minutes, world=play_options.world)


def _make_games_by_agent(first_game: Game, against: Path | None) -> dict[str, Game]:
    """Return the game of each agent, by the name of the agent.

    :param against: the second agent; None: only the first agent plays.
    :raises CxbridgeError: if both agents are the same.
    """
    options = first_game.run_options
    # a game of a plug-in needs no scenario: the first overlay has the agent, or else the Fawkes checkout
    agent_folder, *_ = options.overlays or (options.fawkes_dir,)
    games = {str(options.scenario or agent_folder): first_game}
    if against is not None:
        games[str(against)] = first_game.replace_agent(against)
        if len(games) == 1:
            raise CxbridgeError(f"--against names the same agent: {against}", hint="name another agent")
    return games


def _report_game(result: GameResult, *, as_json: bool) -> int:
    """Print the result of a game, and return the exit status."""
    from cxbridge_explore.cli.game.output import print_game

    if as_json:
        say_json(result.as_dict(), indent=2)
    else:
        print_game(result)
    return _report_problems({result.seed: result})


def _play_series(games: Mapping[str, Game], play_options: PlayOptions, *, as_json: bool) -> int:
    """Play each game with each seed, print the results, and return the exit status."""
    from cxbridge_explore.cli.game.output import print_games
    from cxbridge_explore.game.match import Match, play_games, summarize_games

    seeds = range(play_options.seed, play_options.seed + play_options.games)
    with progress_line() as show_line:
        results_by_agent = play_games(games, seeds, play_options.jobs or os.cpu_count() or 1, show_line)
    if not as_json:
        print_games(results_by_agent)
    else:
        report = {"agents": {name: summarize_games(results) for name, results in results_by_agent.items()}}
        if len(results_by_agent) > 1:
            report["comparison"] = Match(*results_by_agent.values()).as_dict()
        say_json({**report, "seed": play_options.seed}, indent=2)
    # of two agents with problems, the larger exit status counts: an error of cxbridge itself has the largest
    return max(_report_problems(results) for results in results_by_agent.values())


def _report_problems(results: Mapping[int, GameResult]) -> int:
    """Print the undefined constructs and faults of games, and return the exit status.

    :param results: the results by seed.
    """
    # printed once, since all games have the same agent, and so the same undefined constructs
    undefined_constructs = dict.fromkeys(
        construct for result in results.values() for construct in result.undefined_constructs
    )
    for construct in undefined_constructs:
        complain(f"{construct}; its actions never run")
    for seed, result in results.items():
        for fault in result.faults:
            complain(f"seed {seed}: {fault}")
    if any(result.faults for result in results.values()):
        return EXIT_FAULT
    if any(result.simtest == "FAILED" for result in results.values()):
        return EXIT_TESTS_FAILED
    return 0 if all(result.is_over for result in results.values()) else EXIT_NOT_OVER
