"""The files that come with cxbridge: beside the package in a checkout, inside it in a wheel."""

from __future__ import annotations

from pathlib import Path

from cxbridge.errors import CxbridgeError

_PACKAGE = Path(__file__).resolve().parent


def shipped_dir(name: str) -> Path:
    """Return the folder of shipped files called ``name``: ``interfaces``, ``luaskills`` or ``scenarios``.

    :raises CxbridgeError: when the installation is not complete.
    """
    # ours first: beside an installed package lie those of others
    for candidate in (_PACKAGE / "share" / name, _PACKAGE.parent / name):
        if candidate.is_dir():
            return candidate
    raise CxbridgeError(
        f"this installation of cxbridge lacks its folder '{name}'", hint="install cxbridge again"
    )
