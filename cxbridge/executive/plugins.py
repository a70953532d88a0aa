"""Features of other packages, found by their entry points. How to write one: docs/features.md."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable
from contextlib import suppress
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from msgspec import Struct

from cxbridge.errors import ClipsError
from cxbridge.executive.feature import Feature, FeatureContext

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP: Final = "cxbridge.features"
"""The group of entry points. Each names a feature and a subclass of :class:`Feature`."""
_GROUP: Final = re.compile(r"^\[([^\]\n]+)\]", re.MULTILINE)


class InstalledFeature(Struct, frozen=True):
    """An entry point that names a feature; its package is imported when an environment asks for it."""

    entry: EntryPoint
    context: FeatureContext

    @property
    def name(self) -> str:
        """What the feature is called."""
        return self.entry.name

    def __str__(self) -> str:
        package = self.entry.dist.name if self.entry.dist is not None else "?"
        return f"{self.entry.value} of {package}"

    def load(self) -> Feature:
        """Import and make the feature.

        :raises ClipsError: when it cannot be imported or made, or is none.
        """
        try:
            kind = self.entry.load()
            feature = kind.make(self.context)
        except Exception as error:
            raise self._refuse(f"{type(error).__name__}: {error}") from error
        if not isinstance(feature, Feature):
            raise self._refuse(f"{feature!r} is not a cxbridge.executive.feature.Feature")
        return feature

    def _refuse(self, reason: str) -> ClipsError:
        return ClipsError(
            f"the feature '{self.name}' ({self}) cannot be loaded: {reason}",
            hint="see docs/features.md, or remove that package",
        )


def find_plugins(
    context: FeatureContext, entries: Iterable[EntryPoint] | None = None
) -> list[InstalledFeature]:
    """Return the features that installed packages bring along, sorted by name; nothing is imported.

    :param entries: entry points; those of the group :data:`GROUP` by default.
    """
    found = installed_entry_points(GROUP) if entries is None else entries
    return [InstalledFeature(entry, context) for entry in sorted(found, key=lambda entry: entry.name)]


def installed_entry_points(group: str) -> Iterable[EntryPoint]:
    """Return the entry points of a group, of all packages."""
    if not any(group in _groups_in(folder) for folder in sys.path):
        return ()
    from importlib.metadata import entry_points  # noqa: PLC0415

    return entry_points(group=group)


def _groups_in(folder: str) -> frozenset[str]:
    """Return the groups of entry points that the packages of a folder have."""
    try:
        changed_ns = os.stat(folder or ".").st_mtime_ns  # noqa: PTH116 - in each run; pathlib takes long
    except OSError:
        return frozenset()
    return _read_groups(os.path.abspath(folder), changed_ns)  # noqa: PTH100


@lru_cache(maxsize=64)
def _read_groups(folder: str, changed_ns: int) -> frozenset[str]:  # noqa: ARG001 - a part of the key
    """Look into few files: importlib.metadata reads hundreds. What is installed later changes the folder."""
    groups: set[str] = set()
    with suppress(OSError):
        for name in os.listdir(folder):  # noqa: PTH208
            if name.endswith("-info") and "." in name:
                file = os.path.join(folder, name, "entry_points.txt")  # noqa: PTH118
                with suppress(OSError), open(file, encoding="utf-8", errors="replace") as text:  # noqa: PTH123
                    groups.update(_GROUP.findall(text.read()))
    return frozenset(groups)
