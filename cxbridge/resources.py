"""The files that cxbridge ships, next to the package or inside it; the version, and the daemon's address."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from cxbridge.errors import CxbridgeError

VERSION: Final = "0.2.0"
"""The version of cxbridge, ``cxbridge.__version__``."""

DAEMON_URL: Final = "tcp://127.0.0.1:1911"
"""The default address of a daemon on this machine."""

_PACKAGE = Path(__file__).resolve().parent


def shipped_dir(name: str) -> Path:
    """Return a folder of shipped files: ``interfaces``, ``luaskills``, ``scenarios`` or ``templates``.

    :raises CxbridgeError: if the installation is incomplete.
    """
    # inside the package first, because the folders next to an installed package belong to other packages
    for candidate in (_PACKAGE / "share" / name, _PACKAGE.parent / name):
        if candidate.is_dir():
            return candidate
    raise CxbridgeError(
        f"this installation of cxbridge lacks its folder '{name}'", hint="install cxbridge again"
    )


# typer completes names by these functions, and requires the parameter name `incomplete`
def shipped_scenarios(incomplete: str = "") -> list[str]:
    """Return the shipped scenarios whose names start with a text; empty if the installation is incomplete."""
    return [
        name
        for file in _shipped_files("scenarios", "*/scenario.yaml")
        if (name := file.parent.name).startswith(incomplete)
    ]


def shipped_interfaces(incomplete: str = "") -> list[str]:
    """Return the shipped interface types whose names start with a text.

    The list is empty if the installation is incomplete.
    """
    return [file.stem for file in _shipped_files("interfaces", "*.xml") if file.stem.startswith(incomplete)]


def _shipped_files(folder: str, pattern: str) -> list[Path]:
    try:
        return sorted(shipped_dir(folder).glob(pattern))
    except CxbridgeError:  # `cxbridge doctor` reports an incomplete installation
        return []
