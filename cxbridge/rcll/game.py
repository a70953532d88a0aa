"""A whole game: the team's agent, its robots, the machines and the referee in one run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.config import Configuration
from cxbridge.events import Sink
from cxbridge.executive.protobuf.local import LocalNetwork
from cxbridge.executive.protobuf.types import MessageTypes
from cxbridge.game.playing import play_game
from cxbridge.game.score import POST_GAME, GameResult, Score
from cxbridge.rcll.controller import BEGIN_S, SETUP_S, Controller, Script
from cxbridge.rcll.field import Field
from cxbridge.rcll.machines import Machine
from cxbridge.rcll.refbox import Refbox, find_messages
from cxbridge.rcll.referee import SERVER_PORT, STATION, Referee, RefereeSettings, referee_maker
from cxbridge.rcll.robots import RobotInterfaces, RobotWorld, robot_executor
from cxbridge.rcll.score import phase_of, score_of
from cxbridge.run.agent_context import AgentContext, make_agent_context
from cxbridge.run.assembly import Assembly
from cxbridge.run.options import RunOptions
from cxbridge.run.paths import find_checkouts
from cxbridge.run.program.additions import NOTHING, Additions
from cxbridge.skiller.simulation.estimators import SkillPattern
from cxbridge.worldmodel.model import NOTHING_FAILS, SkillFailure, SkillModel, WorldModel
from cxbridge.worldmodel.reading import read_world

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from cxbridge.run.components.component import Component
    from cxbridge.run.context import RunContext

SCENARIO: Final = Path("rcll-simulator/central_agent.yaml")
"""The configuration that is played unless another one is named; in the ``cfg`` of a checkout."""

MINUTES: Final = 20.0
"""How long the league's production takes."""

_ROBOTS: Final = "/fawkes/bbsync/peers"
_PROTO_DIRS: Final = "/clips-protobuf/proto-dirs"
_SIMULATOR: Final = "/rcll-simulator/enabled"
_TEAM: Final = "/fawkes/agent/team"
_CUT_S: Final = 1.0
_OVER_S: Final = 5.0
"""Seconds that the referee has for the end of the game."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LeagueGame:
    """A game of the league.

    :param run: the agent: its checkouts, spec and recordings.
    :param refbox_dir: a checkout of the referee box.
    :param proto_dirs: folders with message definitions, before those of the checkouts.
    :param referee_config: files that are laid over the configuration of the referee box.
    :param minutes: of the production.
    :param world: what can fail; None: each skill with the likelihood ``failures``.
    :param failures: how likely a skill fails.
    """

    run: RunOptions
    refbox_dir: Path
    proto_dirs: tuple[Path, ...] = ()
    referee_config: tuple[Path, ...] = ()
    minutes: float = MINUTES
    world: Path | None = None
    failures: float = 0.0

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
            clock="virtual",
            # what CLIPS refuses of an agent is told with the result: checkouts live with their defects
            strict=bool(run.strict),
            timeout=BEGIN_S + SETUP_S + self.minutes * 60 + _OVER_S,
        )

    def play(
        self,
        seed: int,
        console: Sink | None = None,
        attach: Callable[[Assembly], None] | None = None,
    ) -> GameResult:
        """Play it.

        :param seed: of the field, the orders and all else that is drawn.
        :param console: gets the log lines.
        :param attach: called with the run, before it is started.
        :raises CxbridgeError: when the input is bad.
        """
        faults: list[str] = []

        def judge(agents: Sequence[Assembly]) -> Score:
            (agent,) = agents
            assert isinstance(agent, LeagueAssembly)
            faults.extend(agent.referee.faults)
            return score_of(agent.referee)

        options, world = self.options, self._world()
        options.check()
        make = partial(self.make, seed)
        found = play_game(options, seed, world, judge, make=make, console=console, attach=attach)
        robots = {name.strip("/").removesuffix("/Skiller"): work for name, work in found.robots.items()}
        return replace(found, robots=robots, faults=(*found.faults, *faults))

    def _world(self) -> WorldModel:
        if self.world is not None:
            return read_world(self.world)
        if not self.failures:
            return NOTHING_FAILS
        failure = SkillFailure(error="the skill has failed, as was drawn", probability=self.failures)
        return WorldModel(otherwise=SkillModel(SkillPattern("*"), (failure,)))

    def make(self, seed: int, options: RunOptions, additions: Additions = NOTHING) -> LeagueAssembly:
        """Make the run of a game.

        :param seed: of the field, the orders and all else that is drawn.
        :param options: those of this game, or with another recording.
        :raises CxbridgeError: when the input is bad.
        """
        return LeagueAssembly(_Parts(self, options, seed), additions)


class LeagueAssembly(Assembly):
    """The run of a game: it is over when the referee says so."""

    def __init__(self, parts: _Parts, additions: Additions) -> None:
        self._parts = parts
        context = parts.agent_context()
        more = replace(
            additions,
            executors=(*additions.executors, robot_executor(parts.world)),
            connections=parts.network.join,
        )
        super().__init__(parts.run, context, None, more, tuple(parts.components(context.config)))

    @property
    def referee(self) -> Referee:
        """The referee, once the run is started."""
        return self._parts.referee

    @property
    def is_over(self) -> bool:
        """Whether the game has come to its end."""
        return phase_of(self.referee) == POST_GAME


class _Parts:
    """The parts of a game besides the agent's own."""

    def __init__(self, options: LeagueGame, run: RunOptions, seed: int) -> None:
        self._options, self.run = options, run
        refbox = Refbox.open(options.refbox_dir)
        checkouts = find_checkouts(run).folders
        self._messages = find_messages(
            *options.proto_dirs,
            *(folder / "src/libs/llsf_msgs/rcll-protobuf-msgs" for folder in checkouts),
            refbox.messages,
        )
        self.network = LocalNetwork()
        config = refbox.configuration(*options.referee_config)
        for station in config.keys(STATION):
            config.set(f"{STATION}{station}/connection", "simulated")
        self._settings = RefereeSettings(refbox, config, self._messages, self.network, seed)
        self._referee: Referee | None = None
        self.world = RobotWorld(Field(lambda: self.referee.facts("machine")), self._machine)

    @property
    def referee(self) -> Referee:
        """The referee, once the run is started."""
        assert self._referee is not None
        return self._referee

    def _machine(self, name: str) -> Machine | None:
        return self.referee.machines.get(name)

    def _made(self, referee: Referee) -> None:
        self._referee = referee

    def agent_context(self) -> AgentContext:
        """Read the team's configuration, and set what differs in a simulated game."""
        context = make_agent_context(self.run)
        config = context.config
        names = [name for name in config.keys(_ROBOTS) if name.startswith("robot") and name[5:].isdigit()]
        self.world.add(names)
        for name in names:
            config.set(f"{_ROBOTS}/{name}/active", True)
            config.set(f"/skill-board/agents/{name}/skiller", f"/{name}/Skiller")
        config.set(_SIMULATOR, False)  # its robots take tasks over sockets; ours are Skillers
        config.set(_PROTO_DIRS, [str(self._messages)])
        return context

    def components(self, config: Configuration) -> Iterator[Callable[[RunContext], Component]]:
        """Yield what makes the components of the run that are not the agent's."""
        team = config.get_str(_TEAM, default="Carologistics")
        script = Script(cyan=team, production_s=self._options.minutes * 60)

        def controller(context: RunContext) -> Component:
            types = MessageTypes(context.bus.logger("Controller").warn)
            types.add_folders((self._messages,))
            port = self._settings.config.get_uint(SERVER_PORT, default=0)
            return Controller(context, self.network, types, port, script)

        yield referee_maker(self._settings, self._made)
        yield controller
        yield lambda context: RobotInterfaces(context, self.world)
