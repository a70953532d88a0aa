"""The additions of a Python program to a run: features, skills, and recorders."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cxbridge.executive.feature import Feature
    from cxbridge.skiller.board.executor import SkillExecutor
    from cxbridge.trace.formats.base import RunWriter


@dataclass(frozen=True, slots=True)
class Additions:
    """The additions of a program to a run.

    :param features: given to the executive's environment before it loads its first file.
    :param executors: classes that execute skills, for each agent of the skill board; without a skill board in
        the configuration they serve the Skillers of the run.
    :param writers: get the events of the run, and are closed at its end.
    :param planning: makes the PlanningService of the environment of that name; None: planners plan.
    :param values: read by features and components of plug-ins, by names that begin with the plug-in's.
    """

    features: tuple[Feature, ...] = ()
    executors: tuple[type[SkillExecutor], ...] = ()
    writers: tuple[RunWriter, ...] = ()
    planning: Callable[[str], Any] | None = None
    values: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))


NOTHING = Additions()
