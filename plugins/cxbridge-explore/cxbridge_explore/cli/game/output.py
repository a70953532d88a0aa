"""The printed output of ``cxbridge game``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from cxbridge.cli.console import say
from cxbridge.printing import format_count
from cxbridge_explore.game.match import Match, mean_points
from cxbridge_explore.game.score import GameResult


def print_game(result: GameResult) -> None:
    """Print the awards, deliveries and orders, the work of robots and machines, and the score of a game."""
    score = result.score
    for award in score.awards:
        say(f"{award.game_time:8.1f} s  {award.team:8}{award.points:+5d}  {award.reason}")
    for delivery in score.deliveries:
        product = f"order {delivery.order} ({delivery.complexity})"
        say(f"{delivery.game_time:8.1f} s  {delivery.team:8} delivers {product}")
    for order in score.orders:
        times = ", ".join(f"{seconds:g} s" for seconds in score.delivery_times(order)) or "never"
        window = f"{order.begin:g} to {order.end:g} s"
        say(f"order {order.order} ({order.complexity}): {window}; delivered: {times}")
    for name, work in result.robots.items():
        failures = "".join(f"; {count} times: {error}" for error, count in work.failed.items())
        say(f"busy: {name} {work.busy_seconds:g} s, idle {work.idle_seconds:g} s{failures}")
    for name, states in result.machine_seconds.items():
        say(f"machine: {name} {', '.join(f'{state} {seconds:g} s' for state, seconds in states.items())}")
    for team, categories in score.categories.items():
        for category, total in Counter(categories).most_common():
            say(f"points: {team} {total:+d} {category}")
    if result.simtest:
        say(f"the agent's own tests: {result.simtest}")
    points_text = ", ".join(f"{team} {points}" for team, points in score.points.items())
    end_text = "over" if result.is_over else f"not over, in {score.phase}"
    say(
        f"{points_text}; {len(score.deliveries)} deliveries; the game is {end_text} after "
        f"{score.game_time:g} s; seed {result.seed}, {result.wall_seconds:g} s"
    )


def print_games(results_by_agent: Mapping[str, Mapping[int, GameResult]]) -> None:
    """Print the mean points of each agent, then the points of each game, or the comparison of two agents.

    :param results_by_agent: the results by agent and seed, of one or two agents.
    """
    for name, results in results_by_agent.items():
        over_count = sum(result.is_over for result in results.values())
        say(f"{name}: {format_count(len(results), 'game')}, {over_count} over, {_format_points(results)}")
    if len(results_by_agent) == 1:
        for seed, result in next(iter(results_by_agent.values())).items():
            say(f"  seed {seed}: {result.points} points, {len(result.score.deliveries)} deliveries")
        return
    (first_agent, second_agent), (first_results, second_results) = (
        results_by_agent,
        results_by_agent.values(),
    )
    match = Match(first_results, second_results)
    difference = match.difference
    bounds_text = difference.format_bounds("+.1f")
    say(f"{second_agent} minus {first_agent}: {difference.estimate:+.1f} points a game ({bounds_text})")
    for seed, first_points, second_points in match.most_different_games():
        say(f"  seed {seed}: {first_points} and {second_points} points")
    better_index = match.better_index
    if better_index is None:
        say("these games do not show which agent is better")
    else:
        say(f"{(first_agent, second_agent)[better_index]} is better")


def _format_points(results: Mapping[int, GameResult]) -> str:
    points = mean_points(results)
    if len(results) == 1:
        return f"{points.estimate:g} points"
    return f"{points.estimate:.1f} points a game ({points.format_bounds('.1f')})"
