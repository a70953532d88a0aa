"""Completions that the shell offers for a begun argument. Reads names of files, imports nothing heavy."""

from __future__ import annotations

from collections.abc import Iterator

from cxbridge.errors import CxbridgeError
from cxbridge.resources import shipped_dir

_SCENARIO = "scenario.yaml"


def _matches(folder: str, pattern: str, incomplete: str) -> Iterator[str]:
    try:
        found = sorted(shipped_dir(folder).glob(pattern))
    except CxbridgeError:  # an installation that is not complete: `doctor` tells
        return
    for path in found:
        name = path.parent.name if path.name == _SCENARIO else path.stem
        if name.startswith(incomplete):
            yield name


def scenarios(incomplete: str) -> list[str]:
    """Return the shipped scenarios that begin so; without any the shell offers files."""
    return list(_matches("scenarios", f"*/{_SCENARIO}", incomplete))


def interfaces(incomplete: str) -> list[str]:
    """Return the shipped interface types that begin so; without any the shell offers files."""
    return list(_matches("interfaces", "*.xml", incomplete))
