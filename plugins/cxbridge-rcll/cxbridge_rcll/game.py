"""A whole game: the team's agent, its robots, the machines and the referee in one run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.events import LogLine, Sink
from cxbridge.run.options import RunOptions
from cxbridge.run.program.additions import NOTHING, Additions
from cxbridge.skiller.simulation.estimators import SkillPattern
from cxbridge_explore.game.judge import Standing
from cxbridge_explore.game.playing import play_game
from cxbridge_explore.game.score import GameResult, Score
from cxbridge_explore.worldmodel.model import NOTHING_FAILS, SkillFailure, SkillModel, WorldModel
from cxbridge_explore.worldmodel.reading import read_world
from cxbridge_rcll.assembly import GameParts, GameReferee, LeagueAssembly, LeagueTeam
from cxbridge_rcll.controller import BEGIN_S, SETUP_S
from cxbridge_rcll.settings import LeagueSettings
from cxbridge_rcll.simtest import Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from cxbridge.run.agent import Run
    from cxbridge.run.team import Team

SCENARIO: Final = Path("rcll-simulator/central_agent.yaml")
"""The configuration that is played unless another one is named; in the ``cfg`` of a checkout."""

_CUT_S: Final = 1.0
_OVER_S: Final = 5.0
"""Seconds that the referee has for the end of the game."""

_LOADING_S: Final = 60.0
"""Real seconds for that, and for loading the agent: a real clock does not wait."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LeagueGame(LeagueSettings):
    """A game of the league.

    :param world: what can fail; None: each skill with the likelihood ``failures``.
    :param failures: how likely a skill fails.
    """

    world: Path | None = None
    failures: float = 0.0

    @property
    def quiet(self) -> Collection[str]:
        """The components whose log lines are shown with ``--verbose`` only."""
        return ("Referee",)

    def of_agent(self, agent: Path) -> LeagueGame:
        """Return the same game of another agent: a folder that is laid over the first agent's.

        :raises CxbridgeError: when the options contradict each other.
        """
        run = replace(self.run, overlays=(agent, *self.run.overlays))
        run.check()
        return replace(self, run=run)

    @property
    def cut_options(self) -> RunOptions:
        """The options of a run that ends with the production: no goal has failed since the game was over."""
        return replace(self.options, timeout=BEGIN_S + SETUP_S + self.minutes * 60 - _CUT_S)

    @property
    def options(self) -> RunOptions:
        """The options of its run."""
        run = self.run
        return replace(
            run,
            scenario=run.scenario or SCENARIO,
            skiller="none",
            clock=self._clock,
            # what CLIPS refuses of an agent is reported with the result: checkouts live with their defects
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
        """Play it.

        :param seed: of the field, the orders and all else that is drawn.
        :param console: gets the log lines.
        :param attach: called with the run, before it is started.
        :raises CxbridgeError: when the input is bad.
        """
        referees: list[GameReferee] = []

        def make(options: RunOptions, additions: Additions) -> LeagueAssembly | LeagueTeam:
            made = self.make(seed, options, additions)
            referees.append(made.referee)
            return made

        verdict = Verdict()

        def listen(agent: Run) -> None:
            agent.bus.subscribe(verdict, LogLine)
            if attach is not None:
                attach(agent)

        options, world = self.options, self._world()
        options.check()
        found = play_game(options, seed, world, _Judge(referees), make=make, console=console, attach=listen)
        return replace(
            found,
            is_over=bool(verdict.text) if self.simtest else found.is_over,
            faults=(*found.faults, *referees[0].faults),
            simtest=verdict.text if self.simtest else "",
        )

    def _world(self) -> WorldModel:
        if self.world is not None:
            return read_world(self.world)
        if not self.failures:
            return NOTHING_FAILS
        failure = SkillFailure(error="the skill has failed, as was drawn", probability=self.failures)
        return WorldModel(otherwise=SkillModel(SkillPattern("*"), (failure,)))

    def make(
        self, seed: int, options: RunOptions, additions: Additions = NOTHING
    ) -> LeagueAssembly | LeagueTeam:
        """Make the run of a game.

        :param seed: of the field, the orders and all else that is drawn.
        :param options: those of this game, or with another recording.
        :raises CxbridgeError: when the input is bad.
        """
        parts = GameParts(self, options, seed)
        return (LeagueTeam if parts.is_team else LeagueAssembly)(parts, additions)


class _Judge:
    """Judges as the referee does that a run is made with.

    :param referees: gets it when the run is made.
    """

    def __init__(self, referees: Sequence[GameReferee]) -> None:
        self._referees = referees

    def watch(self, run: Run | Team) -> None:
        """Do nothing: the referee is a part of the run."""

    def standing(self) -> Standing:
        """Return the referee's findings."""
        return self._referees[0].standing

    def score(self, _agents: Sequence[Run]) -> Score:
        """Return how the game stands."""
        return self._referees[0].score
