"""Command-line options for games of the RoboCup Logistics League."""

from __future__ import annotations

from dataclasses import MISSING, dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.errors import CxbridgeError

if TYPE_CHECKING:
    from cxbridge.run.options import RunOptions
    from cxbridge_explore.worlds.run import MakeAssembly
    from cxbridge_rcll.game import LeagueGame


@dataclass(frozen=True, kw_only=True)
class RefboxOptions:
    """The options of the referee box, for explored and for played games of the league.

    :param refbox_dir: a checkout of the referee box; None if no league game is requested.
    :param proto_dirs: folders with message definitions, searched before those of the checkouts.
    :param referee_config: files that are laid over the configuration of the referee box.
    """

    refbox_dir: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Play in the RoboCup Logistics League, with the unchanged rules of this checkout of "
            "rcll-refbox.",
            show_default=False,
        ),
    ] = None
    proto_dirs: Annotated[
        tuple[Path, ...],
        typer.Option(
            "--proto-dir",
            metavar="DIR",
            help="Read the league's message definitions from this folder, if the checkouts lack their "
            "submodules. Repeatable.",
        ),
    ] = ()
    referee_config: Annotated[
        tuple[Path, ...],
        typer.Option(metavar="FILE", help="Lay this file over the referee box's configuration. Repeatable."),
    ] = ()

    @property
    def is_chosen(self) -> bool:
        """Whether a league game is requested."""
        return self.refbox_dir is not None

    def refuse_game_options(self) -> None:
        """Refuse the options of league games, since no league game is requested.

        :raises CxbridgeError: if an option is set.
        """
        for option in fields(self):
            if option.default is not MISSING and getattr(self, option.name) != option.default:
                # --proto-dir is repeatable, and the only option with another name than its field
                name = option.name.removesuffix("s") if option.name == "proto_dirs" else option.name
                raise CxbridgeError(
                    f"--{name.replace('_', '-')} applies only to games of the league",
                    hint="name the referee: --refbox-dir",
                )


@dataclass(frozen=True, kw_only=True)
class ExploredLeagueOptions(RefboxOptions):
    """Options of ``cxbridge explore`` that select and configure a league game."""

    seed: Annotated[
        int, typer.Option(help="The seed of the field, the orders and all further draws of a league game.")
    ] = 0
    minutes: Annotated[
        float,
        typer.Option(min=0, metavar="M", help="The duration of the production of a league game, in minutes."),
    ] = 20.0

    def prepare_exploration(self, options: RunOptions) -> tuple[RunOptions, MakeAssembly]:
        """Return the options of a run that stops just before the end of the production, and its factory."""
        from cxbridge_rcll.game import LeagueGame  # noqa: PLC0415 - slow, and help needs no game

        assert self.refbox_dir is not None  # the group is chosen by --refbox-dir
        game = LeagueGame(
            run_options=options,
            refbox_dir=self.refbox_dir,
            proto_dirs=self.proto_dirs,
            referee_config=self.referee_config,
            minutes=self.minutes,
        )
        return game.explored_run_options, partial(game.make_run, self.seed)


@dataclass(frozen=True, kw_only=True)
class PlayedLeagueOptions(RefboxOptions):
    """Options of ``cxbridge game`` that select and configure a league game."""

    failures: Annotated[
        float,
        typer.Option(
            min=0, max=1, metavar="P", help="The probability that a robot's skill fails in a league game."
        ),
    ] = 0.0
    simtest: Annotated[
        str,
        typer.Option(
            metavar="TESTBED",
            help="Run this testbed of the agent's own tests, e.g. FULL or ENTER-FIELD; "
            "exit status 1 if a test fails.",
            show_default=False,
        ),
    ] = ""

    def make_game(self, run_options: RunOptions, *, minutes: float | None, world: Path | None) -> LeagueGame:
        """Return the game.

        :param minutes: the minutes of the production; None stands for the duration in the league.
        :param world: a file with the failures of skills; None if the option ``failures`` defines them.
        :raises CxbridgeError: if options conflict, or no option names an agent.
        """
        from cxbridge_rcll.game import LeagueGame  # noqa: PLC0415 - slow, and help needs no game

        if world is not None and self.failures:
            raise CxbridgeError("--world and --failures both define the failures", hint="omit one option")
        if run_options.fawkes_dir is None and not run_options.overlays:
            raise CxbridgeError(
                "no agent is named",
                hint="name the team's checkout with --overlay, and a Fawkes checkout with --fawkes-dir",
            )
        assert self.refbox_dir is not None  # the group is chosen by --refbox-dir
        game = LeagueGame(
            run_options=run_options,
            refbox_dir=self.refbox_dir,
            proto_dirs=self.proto_dirs,
            referee_config=self.referee_config,
            world=world,
            failures=self.failures,
            simtest=self.simtest,
        )
        return game if minutes is None else replace(game, minutes=minutes)
