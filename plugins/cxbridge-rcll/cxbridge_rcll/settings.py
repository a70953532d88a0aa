"""The settings of a game of the league."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from cxbridge.run.options import RunOptions
    from cxbridge_rcll.remote import Address

PRODUCTION_MINUTES: Final = 20.0  # the duration of the production phase in the league


@dataclass(frozen=True, slots=True, kw_only=True)
class LeagueSettings:
    """The settings of a game of the league.

    :param run_options: the options of the agent's run: its checkouts, spec and recordings.
    :param refbox_dir: a checkout of the referee box for a referee in this process; None if ``referee`` is
        set.
    :param referee: the address of a referee box; None for a referee in this process.
    :param speed: the speed of time in the referee box at ``referee``.
    :param proto_dirs: folders with message definitions, searched before those of the checkouts.
    :param referee_config: files on top of the configuration of the referee box.
    :param minutes: the minutes of the production phase.
    :param simtest: the testbed of the agent's own tests, e.g. ``FULL``; empty for a game without tests.
    """

    run_options: RunOptions
    refbox_dir: Path | None = None
    referee: Address | None = None
    speed: float = 1.0
    proto_dirs: tuple[Path, ...] = ()
    referee_config: tuple[Path, ...] = ()
    minutes: float = PRODUCTION_MINUTES
    simtest: str = ""
