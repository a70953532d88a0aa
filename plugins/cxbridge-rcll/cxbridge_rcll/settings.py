"""The settings of a game of the league."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from cxbridge.run.options import RunOptions

PRODUCTION_MINUTES: Final = 20.0  # the duration of the production phase in the league


@dataclass(frozen=True, slots=True, kw_only=True)
class LeagueSettings:
    """The settings of a game of the league.

    :param run_options: the options of the agent's run: its checkouts, spec and recordings.
    :param refbox_dir: a checkout of the referee box, whose rules run in this process.
    :param proto_dirs: folders with message definitions, searched before those of the checkouts.
    :param referee_config: files on top of the configuration of the referee box.
    :param minutes: the minutes of the production phase.
    :param simtest: the testbed of the agent's own tests, e.g. ``FULL``; empty for a game without tests.
    """

    run_options: RunOptions
    refbox_dir: Path
    proto_dirs: tuple[Path, ...] = ()
    referee_config: tuple[Path, ...] = ()
    minutes: float = PRODUCTION_MINUTES
    simtest: str = ""
