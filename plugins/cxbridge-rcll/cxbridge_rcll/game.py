"""A whole game: the team's agent, its robots, the machines and the referee in one run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.events import LogLine, Sink
from cxbridge.run.options import RunOptions
from cxbridge.run.program.additions import NOTHING, Additions
from cxbridge.skiller.simulation.estimators import SkillPattern
from cxbridge_explore.game.judge import GameState
from cxbridge_explore.game.playing import play_game
from cxbridge_explore.game.score import GameResult, Score
from cxbridge_explore.worldmodel.model import NOTHING_FAILS, SkillFailure, SkillModel, WorldModel
from cxbridge_explore.worldmodel.reading import read_world
from cxbridge_rcll.assembly import GameReferee, GameSetup, LeagueAssembly, LeagueTeam
from cxbridge_rcll.controller import BEGIN_S, SETUP_S
from cxbridge_rcll.settings import LeagueSettings
from cxbridge_rcll.simtest import Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from cxbridge.run.agent import Run
    from cxbridge.run.team import Team

# The default configuration, relative to the `cfg` folder of a checkout.
SCENARIO: Final = Path("rcll-simulator/central_agent.yaml")

_CUT_S: Final = 1.0  # the seconds before the end of the game at which an exploration stops
_OVER_S: Final = 5.0  # the seconds that the referee has for the end of the game

# The real seconds for loading the agent and ending the game: a real clock does not wait for either.
_LOADING_S: Final = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LeagueGame(LeagueSettings):
    """A game of the league.

    :param world: possible failures; None if each skill fails with the probability ``failures``.
    :param failures: the probability that a skill fails.
    """

    world: Path | None = None
    failures: float = 0.0

    @property
    def quiet(self) -> Collection[str]:
        """Components whose log lines need ``--verbose``."""
        return ("Referee",)

    def of_agent(self, agent: Path) -> LeagueGame:
        """Return the same game with another agent: a folder on top of the first agent's.

        :raises CxbridgeError: if options conflict.
        """
        run = replace(self.run, overlays=(agent, *self.run.overlays))
        run.check()
        return replace(self, run=run)

    @property
    def cut_options(self) -> RunOptions:
        """The options of a run that ends with the production, before goals fail because the game is over."""
        return replace(self.options, timeout=BEGIN_S + SETUP_S + self.minutes * 60 - _CUT_S)

    @property
    def options(self) -> RunOptions:
        """The options of the run with the referee's clock and a time limit after the end of the game."""
        run = self.run
        return replace(
            run,
            scenario=run.scenario or SCENARIO,
            skiller="none",
            clock=self._clock,
            # Checkouts have known CLIPS errors, which the result reports instead of ending the game.
            strict=bool(run.strict),
            timeout=BEGIN_S
            + SETUP_S
            + self.minutes * 60
            + (_LOADING_S * self.speed if self.referee else _OVER_S),
        )

    @property
    def _clock(self) -> str:
        if self.referee is None:
            return "virtual"
        return "real" if self.speed == 1 else f"scaled:{self.speed:g}"

    def play(
        self,
        seed: int,
        console: Sink | None = None,
        attach: Callable[[Run], None] | None = None,
    ) -> GameResult:
        """Play the game.

        :param seed: the seed for the field, the orders and all further random choices.
        :param console: receives the log lines.
        :param attach: called with the run before its start.
        """
        verdict, judge = Verdict(), _Judge()

        def listen(agent: Run) -> None:
            agent.bus.subscribe(verdict, LogLine)
            if attach is not None:
                attach(agent)

        options, world = self.options, self._world()
        options.check()
        make = partial(self.make, seed)
        result = play_game(options, seed, world, judge, make=make, console=console, attach=listen)
        return replace(
            result,
            is_over=bool(verdict.text) if self.simtest else result.is_over,
            faults=(*result.faults, *judge.referee.faults),
            simtest=verdict.text if self.simtest else "",
        )

    def _world(self) -> WorldModel:
        """Return the failures of skills: those of ``world``, or with the probability ``failures``."""
        if self.world is not None:
            return read_world(self.world)
        if not self.failures:
            return NOTHING_FAILS
        failure = SkillFailure(error="the skill has failed, as was drawn", probability=self.failures)
        return WorldModel(otherwise=SkillModel(SkillPattern("*"), (failure,)))

    def make(
        self, seed: int, options: RunOptions, additions: Additions = NOTHING
    ) -> LeagueAssembly | LeagueTeam:
        """Create the run of a game.

        :param seed: the seed for the field, the orders and all further random choices.
        :param options: the options of this game, possibly with another recording.
        """
        setup = GameSetup(self, options, seed)
        return (LeagueTeam if setup.is_team else LeagueAssembly)(setup, additions)


class _Judge:
    """Returns the score and the state that the referee of a run reports."""

    referee: GameReferee  # set when the run is made

    def watch(self, run: Run | Team) -> None:
        """Use the referee of a run."""
        assert isinstance(run, LeagueAssembly | LeagueTeam)
        self.referee = run.referee

    def state(self) -> GameState:
        return self.referee.state

    def score(self, _agents: Sequence[Run]) -> Score:
        return self.referee.score
