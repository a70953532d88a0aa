"""Plays a game: a run of the team's agent with its robots, the machines and the referee."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.events import LogLine, Sink
from cxbridge.run.options import RunOptions
from cxbridge.run.program.additions import NO_ADDITIONS, Additions
from cxbridge.skiller.simulation.estimators import SkillPattern
from cxbridge_explore.game.judge import Judge
from cxbridge_explore.game.playing import play_game
from cxbridge_explore.game.score import GameResult
from cxbridge_explore.worldmodel.model import NOTHING_FAILS, SkillFailure, SkillModel, WorldModel
from cxbridge_explore.worldmodel.reading import read_world
from cxbridge_rcll.assembly import GameSetup, LeagueRun, LeagueTeam
from cxbridge_rcll.controller import PRE_GAME_S, SETUP_S
from cxbridge_rcll.settings import LeagueSettings
from cxbridge_rcll.simtest import VerdictListener

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from cxbridge.run.agent import Run
    from cxbridge.run.team import Team

# the default configuration, relative to the folder `cfg` of a checkout
SCENARIO: Final = Path("rcll-simulator/central_agent.yaml")

_EARLY_END_S: Final = 1.0  # the time before the end of the game at which an exploration stops
_ENDING_S: Final = 5.0  # the time in which the referee ends the game


@dataclass(frozen=True, slots=True, kw_only=True)
class LeagueGame(LeagueSettings):
    """A game of the league.

    :param world: a file with the failures of skills; None if each skill fails with the probability
        ``failures``.
    :param failures: the probability that a skill fails.
    """

    world: Path | None = None
    failures: float = 0.0

    @property
    def quiet_components(self) -> Collection[str]:
        """The components whose log lines are only shown with ``--verbose``."""
        return ("Referee",)

    def replace_agent(self, agent: Path) -> LeagueGame:
        """Return the same game with another agent, whose folder is laid over the folders of this game.

        :raises CxbridgeError: if options conflict.
        """
        run_options = replace(self.run_options, overlays=(agent, *self.run_options.overlays))
        run_options.check()
        return replace(self, run_options=run_options)

    @property
    def explored_run_options(self) -> RunOptions:
        """The options of an explored run.

        The run stops before the end of the production, at which open goals would fail.
        """
        return replace(
            self.played_run_options, timeout=PRE_GAME_S + SETUP_S + self.minutes * 60 - _EARLY_END_S
        )

    @property
    def played_run_options(self) -> RunOptions:
        """The options of a played run: on the virtual clock, with a timeout after the end of the game."""
        run_options = self.run_options
        return replace(
            run_options,
            scenario=run_options.scenario or SCENARIO,
            skiller="none",
            clock="virtual",
            # not strict by default: the agents of teams have CLIPS errors, which the result reports
            strict=bool(run_options.strict),
            timeout=PRE_GAME_S + SETUP_S + self.minutes * 60 + _ENDING_S,
        )

    def play(
        self,
        seed: int,
        console: Sink | None = None,
        attach: Callable[[Run], None] | None = None,
    ) -> GameResult:
        """Play the game.

        :param seed: the seed for the field, the orders and all further random choices.
        :param console: receives the log lines.
        :param attach: called with each agent before the game.
        :raises CxbridgeError: if options conflict, the file ``world`` is wrong, or the game cannot be set up.
        """
        verdict_listener = VerdictListener()

        def make_judge(run: Run | Team) -> Judge:
            assert isinstance(run, LeagueRun | LeagueTeam)
            run.bus.subscribe(verdict_listener, LogLine)
            return run.referee

        options, world_model = self.played_run_options, self._make_world_model()
        options.check()
        result = play_game(
            options,
            seed,
            world_model,
            make_judge,
            make_assembly=partial(self.make_run, seed),
            console=console,
            attach=attach,
        )
        return replace(
            result,
            is_over=bool(verdict_listener.verdict) if self.simtest else result.is_over,
            simtest=verdict_listener.verdict if self.simtest else "",
        )

    def _make_world_model(self) -> WorldModel:
        """Return the failures of skills: from the file ``world``, or with the probability ``failures``."""
        if self.world is not None:
            return read_world(self.world)
        if not self.failures:
            return NOTHING_FAILS
        failure = SkillFailure(error="a randomly drawn failure", probability=self.failures)
        return WorldModel(default_skill=SkillModel(SkillPattern("*"), (failure,)))

    def make_run(
        self, seed: int, options: RunOptions, additions: Additions = NO_ADDITIONS
    ) -> LeagueRun | LeagueTeam:
        """Create the run of a game.

        :param seed: the seed for the field, the orders and all further random choices.
        :param options: the options of this game, possibly with another recording.
        :param additions: additions to the run, besides those of the game.
        :raises CxbridgeError: as :class:`GameSetup`, or if the agent cannot be set up.
        """
        setup = GameSetup(self, options, seed)
        return (LeagueTeam if setup.is_team else LeagueRun)(setup, additions)
