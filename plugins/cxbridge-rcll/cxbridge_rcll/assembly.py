"""Assembles the run of a game from agents, robots and a referee, and adapts the agents' configuration."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

from msgspec.structs import replace

from cxbridge.config import Configuration
from cxbridge.run.agent import MakeComponent, Run, make_base
from cxbridge.run.agents import AGENT_NAME, AGENTS
from cxbridge.run.options import RunOptions
from cxbridge.run.program.additions import Additions
from cxbridge.run.source import source_of
from cxbridge.run.team import Team
from cxbridge_explore.game.score import POST_GAME
from cxbridge_protobuf.settings import CONNECTIONS_KEY
from cxbridge_rcll.field import Field
from cxbridge_rcll.local_referee import LocalReferee
from cxbridge_rcll.machines import Machine
from cxbridge_rcll.refbox import Refbox, find_message_folder
from cxbridge_rcll.robots import RobotInterfaces, RobotWorld, make_robot_executor
from cxbridge_rcll.settings import LeagueSettings
from cxbridge_rcll.simtest import enable_simtest
from cxbridge_rcll.stations import StationNodes

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cxbridge.run.components.component import Component

_PEERS_PATH: Final = "/fawkes/bbsync/peers"
_SPEC_PATH: Final = "/clips-executive/spec"
_SPECS_PATH: Final = "/clips-executive/specs"
_COORDINATION_PATH: Final = "parameters/coordination"
_ROUTES_PATH: Final = "parameters/rcll/route"
_PEER_PATTERN: Final = re.compile(r"robot\d+")
_ROBOT_NAMES: Final = ("R-1", "R-2", "R-3")  # for a spec that configures no routes of robots
_AGENT_NUMBER_PATH: Final = "/fawkes/agent/number"
_PROTO_DIRS_PATH: Final = "/clips-protobuf/proto-dirs"
_SIMULATOR_PATH: Final = "/rcll-simulator/enabled"
_TEAM_NAME_PATH: Final = "/fawkes/agent/team"


class LeagueRun(Run):
    """The run of a game with one executive. The run ends with the game, or if the agent quits."""

    def __init__(self, setup: GameSetup, additions: Additions) -> None:
        self.referee = setup.referee
        factories = (
            *setup.referee_factories(),
            setup.interface_factory({name: f"/{name}/" for name in setup.robot_names}),
        )
        super().__init__(
            setup.run_options, setup.base, additions=setup.extend(additions), components=factories
        )

    @property
    def is_over(self) -> bool:
        """Whether the game has ended or the agent has quit."""
        return self.referee.phase == POST_GAME or self.executive.env.quit_requested


class LeagueTeam(Team):
    """The run of a game with an executive per robot. The run ends with the game, or if an agent quits."""

    def __init__(self, setup: GameSetup, additions: Additions) -> None:
        self.referee = setup.referee

        def make_factories(robot: str) -> Sequence[MakeComponent]:
            # the first agent has the referee, which all agents share
            referee = setup.referee_factories() if robot == setup.robot_names[0] else ()
            return (*referee, setup.interface_factory({robot: ""}))

        super().__init__(
            setup.run_options, setup.base, setup.robot_names, setup.extend(additions), make_factories
        )

    @property
    def is_over(self) -> bool:
        """Whether the game has ended or an agent has quit."""
        return self.referee.phase == POST_GAME or any(
            agent.executive.env.quit_requested for agent in self.agents
        )


class GameSetup:
    """The robots and the referee of a game, and the base of its run.

    :param seed: the seed for the field, the orders and all further random choices.
    :ivar is_team: whether each robot has an executive, which coordinates with the other robots.
    :raises CxbridgeError: if the checkout has no rules, no folder has message definitions, or the spec has no
        tests although the settings name a testbed.
    """

    def __init__(self, settings: LeagueSettings, run_options: RunOptions, seed: int) -> None:
        self._minutes, self.run_options = settings.minutes, run_options
        refbox = Refbox.open(settings.refbox_dir)
        checkouts = source_of(run_options).checkouts.folders
        message_folder = find_message_folder(
            *settings.proto_dirs,
            *(folder / "src/libs/llsf_msgs/rcll-protobuf-msgs" for folder in checkouts),
            refbox.message_folder,
        )
        self.referee = LocalReferee(refbox, message_folder, settings.referee_config, seed)
        self.world = RobotWorld(Field(self._machine_facts), self._find_machine)
        self.base = make_base(run_options)
        config = self.base.config
        spec = f"{_SPECS_PATH}/{run_options.spec or config.get_str(_SPEC_PATH, default='')}"
        self.is_team = bool(config.keys(f"{spec}/{_COORDINATION_PATH}"))
        self.robot_names = self._configure_robots(config, spec)
        self.world.add_robots(self.robot_names)
        # With a simulator, the agent would send tasks to robots over sockets. Here robots execute skills.
        config.set(_SIMULATOR_PATH, False)
        config.set(_PROTO_DIRS_PATH, [str(message_folder)])
        if settings.simtest:
            enable_simtest(config, spec, settings.simtest)

    # functions for the field and the robots, since the run makes the referee later

    def _machine_facts(self) -> Iterator[dict[str, Any]]:
        return (slots for _, _, slots in self.referee.component.env.facts("machine"))

    def _find_machine(self, name: str) -> Machine | None:
        return self.referee.component.machines.get(name)

    def _configure_robots(self, config: Configuration, spec: str) -> list[str]:
        """Add the robots to the configuration, and return their names."""
        if self.is_team:
            # the routes of a team have the names of its robots; both teams have the same robots
            robots_by_team = [
                config.keys(f"{spec}/{_ROUTES_PATH}/{team}") for team in config.keys(f"{spec}/{_ROUTES_PATH}")
            ]
            names = next(filter(None, robots_by_team), list(_ROBOT_NAMES))
            for number, name in enumerate(names, start=1):
                robot_tree = f"{AGENTS}/{name}/config"
                config.set(f"{robot_tree}{AGENT_NAME}", name)
                config.set(f"{robot_tree}{_AGENT_NUMBER_PATH}", number)
                config.set(f"{robot_tree}/skill-board/agents/{name}/skiller", "Skiller")
            return names
        # The robots of a central agent are the peers `robot1`, `robot2` ... of bbsync, the plugin of Fawkes
        # that synchronizes blackboards.
        names = [name for name in config.keys(_PEERS_PATH) if _PEER_PATTERN.fullmatch(name)]
        for name in names:
            config.set(f"{_PEERS_PATH}/{name}/active", True)
            config.set(f"/skill-board/agents/{name}/skiller", f"/{name}/Skiller")
        return names

    def extend(self, additions: Additions) -> Additions:
        """Return additions with the executors of the robots and the connections to the referee."""
        executors = (*additions.executors, make_robot_executor(self.world))
        values = {**additions.values, CONNECTIONS_KEY: self.referee.make_connections}
        return replace(additions, executors=executors, values=values)

    def referee_factories(self) -> Iterator[MakeComponent]:
        """Yield the factories of the referee and of its controller."""
        team_name = self.base.config.get_str(_TEAM_NAME_PATH, default="Carologistics")
        return self.referee.component_factories(team_name, self._minutes * 60)

    def interface_factory(self, prefixes: Mapping[str, str]) -> MakeComponent:
        """Return the factory of the robots' interfaces.

        :param prefixes: the prefix of the interface ids by robot name.
        """

        def make_interfaces(context: Run) -> Component:
            # a function, since the first use loads the graph, and an agent may have no graph
            stations = StationNodes(self.world.geometry, lambda: context.navgraph) if self.is_team else None
            return RobotInterfaces(context, self.world, prefixes, stations)

        return make_interfaces
