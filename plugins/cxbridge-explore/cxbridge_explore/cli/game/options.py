"""The options of `cxbridge game`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.errors import CxbridgeError
from cxbridge.run.options import LogOptions, ScenarioOptions, SourceOptions, TraceOptions
from cxbridge_rcll.options import RefboxOptions

if TYPE_CHECKING:
    from cxbridge_rcll.remote import Address


@dataclass(frozen=True, kw_only=True)
class AgentOptions(ScenarioOptions, SourceOptions, TraceOptions, LogOptions):
    """The agent, and what is recorded."""


@dataclass(frozen=True, kw_only=True)
class PlayOptions:
    """What is played."""

    second: Annotated[
        Path | None,
        typer.Argument(metavar="[SCENARIO2]", help="As --against SCENARIO2.", show_default=False),
    ] = None
    against: Annotated[
        Path | None,
        typer.Option(
            metavar="SCENARIO",
            help="A second agent, on the same seeds. With --refbox-dir: a folder that is laid over the "
            "first one's.",
            show_default=False,
        ),
    ] = None
    games: Annotated[int, typer.Option(min=1, metavar="N", help="How many games, each with a seed.")] = 1
    seed: Annotated[int, typer.Option(help="The seed of the first game; the others follow.")] = 0
    minutes: Annotated[
        float | None,
        typer.Option(
            min=0,
            metavar="M",
            help="Minutes of the production; by default as the scenario says, in the league 20.",
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

    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write a page about a single game: points, and a timeline of robots, machines and orders.",
            show_default=False,
        ),
    ] = None

    def second_agent(self) -> Path | None:
        """Return the agent that the first one is compared with."""
        if self.second is not None and self.against is not None:
            raise CxbridgeError(f"there are two second agents: {self.second} and {self.against}")
        return self.second or self.against


@dataclass(frozen=True, kw_only=True)
class LeagueOptions(RefboxOptions):
    """A game of the RoboCup Logistics League."""

    failures: Annotated[
        float,
        typer.Option(min=0, max=1, metavar="P", help="How likely a skill of a robot fails, in the league."),
    ] = 0.0
    referee: Annotated[
        str | None,
        typer.Option(
            metavar="HOST:PORT",
            help="Play in the league with a referee box that runs there, instead of --refbox-dir.",
            show_default=False,
        ),
    ] = None
    speed: Annotated[
        float,
        typer.Option(
            min=0.01, metavar="N", help="How fast time passes for the referee box of --referee: its speedup."
        ),
    ] = 1.0

    simtest: Annotated[
        str,
        typer.Option(
            metavar="TESTBED",
            help="Let the league's agent test itself, e.g. FULL or ENTER-FIELD: exit status 1 when it fails.",
            show_default=False,
        ),
    ] = ""

    @property
    def is_played(self) -> bool:
        """Whether a game of the league is played."""
        return self.refbox_dir is not None or self.referee is not None

    @property
    def address(self) -> Address | None:
        """Where the referee box runs; None: its rules are in the process of the agent.

        :raises CxbridgeError: when an option is for the other way.
        """
        from cxbridge_rcll.remote import Address

        if self.referee is None:
            if self.speed != 1:
                raise CxbridgeError("--speed is for --referee", hint="a game with --refbox-dir never waits")
            return None
        if self.refbox_dir is not None:
            raise CxbridgeError("--referee and --refbox-dir both name the referee", hint="leave one")
        if self.referee_config:
            raise CxbridgeError(
                "--referee-config is for --refbox-dir",
                hint="a referee box that runs has its own configuration",
            )
        return Address.parse(self.referee)
