"""Environments with the built-in or the original core, for benchmarks of both."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import CORE_DIR, ClipsEnvironment

HOST_FILES = ("utils", "time", "path", "ff-config")
DOMAIN_FILES = {
    "fawkes": ("saliences", "plan", "goal", "domain"),
    "builtin": (
        *("saliences", "plan", "goal", "domain"),
        *("domain-index", "domain-grounding", "domain-effects", "domain-exogenous"),
    ),
}
"""The files of domain, plans and goals of each core."""


def has_fawkes() -> bool:
    """Return whether the original core is available."""
    return "FAWKES_DIR" in os.environ


def core_folders(core: str) -> tuple[Path, Path]:
    """Return the folders of the host library and of the core itself.

    :param core: ``fawkes`` or ``builtin``.
    """
    if core == "builtin":
        return CORE_DIR / "host", CORE_DIR / "cx"
    plugins = Path(os.environ["FAWKES_DIR"]) / "src" / "plugins"
    return plugins / "clips" / "clips", plugins / "clips-executive" / "clips"


def make_environment(core: str, *extra: str) -> ClipsEnvironment:
    """Make an environment with a core's host and domain files and ``extra`` of its files, without ``.clp``.

    :raises SystemExit: if a file cannot be read.
    """
    env = ClipsEnvironment("executive", EventBus(VirtualClock()))
    host, cx = core_folders(core)
    for path in [host / name for name in HOST_FILES] + [cx / name for name in DOMAIN_FILES[core] + extra]:
        if not env.batch(path.with_name(path.name + ".clp")):
            sys.exit(f"{path}.clp cannot be read")
    return env
