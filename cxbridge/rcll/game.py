"""A whole game: the team's agent, its robots, the machines and the referee in one run."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.config import Configuration
from cxbridge.events import LogLine, Sink
from cxbridge.executive.protobuf.local import LocalNetwork
from cxbridge.executive.protobuf.types import MessageTypes
from cxbridge.game.score import GameResult, RobotWork
from cxbridge.mainloop import Hook
from cxbridge.rcll.controller import BEGIN_S, SETUP_S, Controller, Phase, Script
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
from cxbridge.run.program.additions import Additions
from cxbridge.run.recording import start_recording

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

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
    :param failures: how likely a skill fails.
    """

    run: RunOptions
    refbox_dir: Path
    proto_dirs: tuple[Path, ...] = ()
    referee_config: tuple[Path, ...] = ()
    minutes: float = MINUTES
    failures: float = 0.0

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
        return _Game(self, seed).play(console, attach)


class _Game:
    """The parts of a game."""

    def __init__(self, options: LeagueGame, seed: int) -> None:
        self._started = time.perf_counter()
        self._options, self._seed = options, seed
        run = options.run
        self.run = replace(run, scenario=run.scenario or SCENARIO, skiller="none", clock="virtual")
        self.run.check()
        refbox = Refbox.open(options.refbox_dir)
        checkouts = find_checkouts(run).folders
        self._messages = find_messages(
            *options.proto_dirs,
            *(folder / "src/libs/llsf_msgs/rcll-protobuf-msgs" for folder in checkouts),
            refbox.messages,
        )
        self._network = LocalNetwork()
        config = refbox.configuration(*options.referee_config)
        for station in config.keys(STATION):
            config.set(f"{STATION}{station}/connection", "simulated")
        self._settings = RefereeSettings(refbox, config, self._messages, self._network, seed)
        self._referee: Referee | None = None
        self.world = RobotWorld(
            Field(lambda: self.referee.facts("machine")),
            self._machine,
            seed,
            options.failures,
        )

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

    def assembly(self) -> Assembly:
        """Make the run."""
        context = self.agent_context()
        additions = Additions(executors=(robot_executor(self.world),), connections=self._network.join)
        return Assembly(
            self.run, context, None, additions, components=tuple(self._components(context.config))
        )

    def _components(self, config: Configuration) -> Iterator[Callable[[RunContext], Component]]:
        team = config.get_str(_TEAM, default="Carologistics")
        script = Script(cyan=team, production_s=self._options.minutes * 60)

        def controller(context: RunContext) -> Component:
            types = MessageTypes(context.bus.logger("Controller").warn)
            types.add_folders((self._messages,))
            port = self._settings.config.get_uint(SERVER_PORT, default=0)
            return Controller(context, self._network, types, port, script)

        yield referee_maker(self._settings, self._made)
        yield controller
        yield lambda context: RobotInterfaces(context, self.world)

    def play(self, console: Sink | None, attach: Callable[[Assembly], None] | None) -> GameResult:
        """Play it."""
        with ExitStack() as stack:
            assembly = stack.enter_context(self.assembly())
            if console is not None:
                assembly.bus.subscribe(console, LogLine)
            if attach is not None:
                attach(assembly)
            recorder = start_recording(assembly, self.run)
            stack.callback(recorder.close)
            assembly.start()
            assembly.loop.add(Hook.POST_LOOP, recorder.flush_when_due)
            seconds = BEGIN_S + SETUP_S + self._options.minutes * 60 + _OVER_S
            end_us = assembly.clock.now_us() + round(seconds * MICROSECONDS)
            assembly.loop.run(lambda: self._is_over() or assembly.clock.now_us() >= end_us)
            result = self._result(assembly)
            recorder.describe(
                {"status": "0" if result.is_over else "3", "reason": f"points: {result.score.points}"}
            )
            return result

    def _is_over(self) -> bool:
        return phase_of(self.referee) == Phase.POST_GAME

    def _result(self, assembly: Assembly) -> GameResult:
        env = assembly.executive.env
        robots = self.world.robots
        return GameResult(
            score_of(self.referee),
            self._is_over(),
            self._seed,
            round(time.perf_counter() - self._started, 3),
            {
                name: RobotWork(round(robot.busy_us / MICROSECONDS, 1), dict(robot.failed))
                for name, robot in robots.items()
            },
            (*self.referee.faults, *env.faults),
            tuple(str(each) for each in env.loader.diagnostics if each.construct),
        )
