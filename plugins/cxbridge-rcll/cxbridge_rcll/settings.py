"""The settings of a game of the league."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from cxbridge.run.options import RunOptions
    from cxbridge_rcll.remote import Address

MINUTES: Final = 20.0
"""How long the league's production takes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LeagueSettings:
    """The settings of a game of the league.

    :param run: the agent: its checkouts, spec and recordings.
    :param refbox_dir: a checkout of the referee box, whose rules decide; None: ``referee`` does.
    :param referee: where a referee box runs; None: its rules are in the process of the agent.
    :param speed: how fast time passes where the referee runs; its rules of this process need none.
    :param proto_dirs: folders with message definitions, before those of the checkouts.
    :param referee_config: files that are laid over the configuration of the referee box.
    :param minutes: of the production.
    :param simtest: the testbed of the agent's own tests, e.g. ``FULL``; empty: they do not run.
    """

    run: RunOptions
    refbox_dir: Path | None = None
    referee: Address | None = None
    speed: float = 1.0
    proto_dirs: tuple[Path, ...] = ()
    referee_config: tuple[Path, ...] = ()
    minutes: float = MINUTES
    simtest: str = ""
