"""The placeholders in configured paths, such as ``@BASEDIR@/src/clips-specs``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

PLACEHOLDERS = ("BASEDIR", "FAWKES_BASEDIR", "RESDIR", "CONFDIR")
"""The placeholders that the CLIPS Executive registers (without their @), in its order."""


def substitute_path(text: str, folders: Mapping[str, str | Path]) -> str:
    """Return a configured path with its placeholders replaced.

    Each placeholder is replaced once, where it stands first, as Fawkes does. One without a folder stays.

    :param folders: the folder for each placeholder, by its name without @, e.g. ``{"BASEDIR":
        "/opt/fawkes"}``.
    """
    for name, folder in folders.items():
        text = text.replace(f"@{name}@", str(folder), 1)
    return text
