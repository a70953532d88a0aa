"""A whole game: the team's agent, its robots, the machines and the referee in one run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol

from cxbridge.config import Configuration
from cxbridge.events import LogLine, Sink
from cxbridge.game.playing import play_game
from cxbridge.game.score import GameResult, Score
from cxbridge.rcll.controller import BEGIN_S, SETUP_S, Script
from cxbridge.rcll.field import Field
from cxbridge.rcll.local import LocalReferee
from cxbridge.rcll.refbox import Refbox, find_messages
from cxbridge.rcll.remote import Address, RemoteReferee
from cxbridge.rcll.robots import RobotInterfaces, RobotWorld, robot_executor
from cxbridge.rcll.simtest import Verdict, turn_on
from cxbridge.rcll.stations import StationNodes
from cxbridge.run.agent_context import AGENT_NAME, AGENTS, make_agent_context
from cxbridge.run.assembly import Assembly, MakeComponent
from cxbridge.run.options import RunOptions
from cxbridge.run.paths import find_checkouts
from cxbridge.run.program.additions import NOTHING, Additions
from cxbridge.run.team import Team
from cxbridge.skiller.simulation.estimators import SkillPattern
from cxbridge.worldmodel.model import NOTHING_FAILS, SkillFailure, SkillModel, WorldModel
from cxbridge.worldmodel.reading import read_world

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cxbridge.executive.host.values import Value
    from cxbridge.executive.protobuf.connections import MakeConnections
    from cxbridge.navgraph import NavGraph
    from cxbridge.rcll.machines import Workplace
    from cxbridge.run.components.component import Component
    from cxbridge.run.context import RunContext

SCENARIO: Final = Path("rcll-simulator/central_agent.yaml")
"""The configuration that is played unless another one is named; in the ``cfg`` of a checkout."""

MINUTES: Final = 20.0
"""How long the league's production takes."""

_ROBOTS: Final = "/fawkes/bbsync/peers"
_SPEC: Final = "/clips-executive/spec"
_SPECS: Final = "/clips-executive/specs"
_COORDINATION: Final = "parameters/coordination"
_ROUTES: Final = "parameters/rcll/route/CYAN"
_NAMES: Final = ("R-1", "R-2", "R-3")
_NUMBER: Final = "/fawkes/agent/number"
_PROTO_DIRS: Final = "/clips-protobuf/proto-dirs"
_SIMULATOR: Final = "/rcll-simulator/enabled"
_TEAM: Final = "/fawkes/agent/team"
_CUT_S: Final = 1.0
_OVER_S: Final = 5.0
"""Seconds that the referee has for the end of the game."""

_LOADING_S: Final = 60.0
"""Real seconds for that, and for loading the agent: a real clock does not wait."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LeagueGame:
    """A game of the league.

    :param run: the agent: its checkouts, spec and recordings.
    :param refbox_dir: a checkout of the referee box, whose rules decide; None: ``referee`` does.
    :param referee: where a referee box runs; None: its rules are in the process of the agent.
    :param speed: how fast time passes where the referee runs; its rules of this process need none.
    :param proto_dirs: folders with message definitions, before those of the checkouts.
    :param referee_config: files that are laid over the configuration of the referee box.
    :param minutes: of the production.
    :param world: what can fail; None: each skill with the likelihood ``failures``.
    :param failures: how likely a skill fails.
    :param simtest: the testbed of the agent's own tests, e.g. ``FULL``; empty: they do not run.
    """

    run: RunOptions
    refbox_dir: Path | None = None
    referee: Address | None = None
    speed: float = 1.0
    proto_dirs: tuple[Path, ...] = ()
    referee_config: tuple[Path, ...] = ()
    minutes: float = MINUTES
    world: Path | None = None
    failures: float = 0.0
    simtest: str = ""

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
            # what CLIPS refuses of an agent is told with the result: checkouts live with their defects
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
        attach: Callable[[Assembly], None] | None = None,
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

        def judge(_agents: Sequence[Assembly]) -> Score:
            return referees[0].score

        verdict = Verdict()

        def listen(agent: Assembly) -> None:
            agent.bus.subscribe(verdict, LogLine)
            if attach is not None:
                attach(agent)

        options, world = self.options, self._world()
        options.check()
        found = play_game(options, seed, world, judge, make=make, console=console, attach=listen)
        robots = {name.strip("/").removesuffix("/Skiller"): work for name, work in found.robots.items()}
        return replace(
            found,
            is_over=bool(verdict.text) if self.simtest else found.is_over,
            robots=robots,
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
        parts = _Parts(self, options, seed)
        return (LeagueTeam if parts.is_team else LeagueAssembly)(parts, additions)


class GameReferee(Protocol):
    """The referee of a game, in this process or elsewhere."""

    @property
    def connections(self) -> MakeConnections | None:
        """What carries the messages of the agent; None: sockets."""

    def set_up(self, config: Configuration) -> None:
        """Set what differs in the configuration of a team."""

    def components(self, script: Script) -> Iterator[Callable[[RunContext], Component]]:
        """Yield what makes the components that a run of a game has for its referee."""

    def machine(self, name: str) -> Workplace | None:
        """Return the machine of a name."""

    def places(self) -> Iterator[dict[str, Value]]:
        """Yield ``name``, ``zone`` and ``rotation`` of each machine."""

    @property
    def score(self) -> Score:
        """How the game stands."""

    @property
    def is_over(self) -> bool:
        """Whether the game has come to its end."""

    @property
    def faults(self) -> Sequence[str]:
        """Errors of ours that came to light."""


class LeagueAssembly(Assembly):
    """The run of a game with one executive: it is over when the referee says so."""

    def __init__(self, parts: _Parts, additions: Additions) -> None:
        self.referee = parts.referee
        more = (*parts.referee_components(), parts.interfaces({name: f"/{name}/" for name in parts.robots}))
        super().__init__(parts.run, parts.context, None, parts.added(additions), more)

    @property
    def is_over(self) -> bool:
        """Whether the game has come to its end, or the agent leaves it."""
        return self.referee.is_over or self.executive.env.quit_requested


class LeagueTeam(Team):
    """The run of a game with an executive for each robot: it is over when the referee says so."""

    def __init__(self, parts: _Parts, additions: Additions) -> None:
        self.referee = parts.referee

        def components(name: str) -> Sequence[MakeComponent]:
            own = (parts.interfaces({name: ""}),)
            return own if name != parts.robots[0] else (*parts.referee_components(), *own)

        super().__init__(parts.run, parts.context, parts.robots, None, parts.added(additions), components)

    @property
    def is_over(self) -> bool:
        """Whether the game has come to its end, or an agent leaves it."""
        return self.referee.is_over or any(agent.executive.env.quit_requested for agent in self.agents)


class _Parts:
    """The parts of a game besides the agent's own.

    :param seed: of the field, the orders and all else that is drawn.
    """

    def __init__(self, options: LeagueGame, run: RunOptions, seed: int) -> None:
        self._minutes, self.run = options.minutes, run
        refbox = None if options.refbox_dir is None else Refbox.open(options.refbox_dir)
        checkouts = find_checkouts(run).folders
        messages = find_messages(
            *options.proto_dirs,
            *(folder / "src/libs/llsf_msgs/rcll-protobuf-msgs" for folder in checkouts),
            *(() if refbox is None else (refbox.messages,)),
        )
        self.referee: GameReferee
        if refbox is not None:
            self.referee = LocalReferee(refbox, messages, options.referee_config, seed)
        else:
            assert options.referee is not None
            self.referee = RemoteReferee(options.referee, messages)
        self.world = RobotWorld(Field(self.referee.places), self.referee.machine)
        self.context = make_agent_context(run)
        config = self.context.config
        spec = f"{_SPECS}/{run.spec or config.get_str(_SPEC, default='')}"
        self.is_team = bool(config.keys(f"{spec}/{_COORDINATION}"))
        """Whether each robot has an executive, which coordinates with the others."""
        self.robots = self._name_robots(config, spec)
        self.world.add(self.robots)
        config.set(_SIMULATOR, False)  # its robots take tasks over sockets; ours are Skillers
        config.set(_PROTO_DIRS, [str(messages)])
        if options.simtest:
            turn_on(config, spec, options.simtest)
        self.referee.set_up(config)

    def _name_robots(self, config: Configuration, spec: str) -> list[str]:
        """Return the names of the robots, and set in the configuration what each one has."""
        if self.is_team:
            names = config.keys(f"{spec}/{_ROUTES}") or list(_NAMES)
            for number, name in enumerate(names, start=1):
                own = f"{AGENTS}/{name}/config"
                config.set(f"{own}{AGENT_NAME}", name)
                config.set(f"{own}{_NUMBER}", number)
                config.set(f"{own}/skill-board/agents/{name}/skiller", "Skiller")
            return names
        names = [name for name in config.keys(_ROBOTS) if name.startswith("robot") and name[5:].isdigit()]
        for name in names:
            config.set(f"{_ROBOTS}/{name}/active", True)
            config.set(f"/skill-board/agents/{name}/skiller", f"/{name}/Skiller")
        return names

    def added(self, additions: Additions) -> Additions:
        """Return what a run gets besides what its options say: robots, and what carries messages."""
        executors = (*additions.executors, robot_executor(self.world))
        return replace(additions, executors=executors, connections=self.referee.connections)

    def referee_components(self) -> Iterator[MakeComponent]:
        """Yield what makes the referee, and who leads it through the game."""
        team = self.context.config.get_str(_TEAM, default="Carologistics")
        return self.referee.components(Script(cyan=team, production_s=self._minutes * 60))

    def interfaces(self, prefixes: Mapping[str, str]) -> MakeComponent:
        """Return what writes the interfaces of robots.

        :param prefixes: what their ids begin with, by the robot's name.
        """

        def make(context: RunContext) -> Component:
            def graph() -> NavGraph:
                return context.navgraph.get(context.config, context.paths, context.bus)

            stations = StationNodes(self.world.places, graph) if self.is_team else None
            return RobotInterfaces(context, self.world, prefixes, stations)

        return make
