"""Additions of a Python program to a run: features, skills and recorders."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from msgspec import Struct, field

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cxbridge.executive.feature import Feature
    from cxbridge.skiller.board.executor import SkillExecutor
    from cxbridge.trace.formats.base import RunWriter


class Additions(Struct, frozen=True):
    """Additions of a program to a run.

    :param features: features of the executive's environment, present before its first file.
    :param executors: executor classes for each agent of the skill board. Without a configured skill board,
        they serve the run's Skillers.
    :param writers: receivers of the run's events, closed at its end.
    :param values: values for features and components of plug-ins, by names with the plug-in's prefix.
    """

    features: tuple[Feature, ...] = ()
    executors: tuple[type[SkillExecutor], ...] = ()
    writers: tuple[RunWriter, ...] = ()
    values: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))


NO_ADDITIONS = Additions()
