"""What a Python program adds to a run that no configuration names: features, skills, and recorders."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from cxbridge.executive.feature import Feature
    from cxbridge.executive.planning.service import PlanningService
    from cxbridge.skiller.board.executor import SkillExecutor
    from cxbridge.trace.formats.base import RunWriter
    from cxbridge_protobuf.connections import MakeConnections


@dataclass(frozen=True, slots=True)
class Additions:
    """What a program adds to a run.

    :param features: given to the executive's environment before it loads its first file.
    :param executors: classes that execute skills, for each agent of the skill board; without a skill board in
        the configuration they serve the Skillers of the run.
    :param writers: get the events of the run, and are closed at its end.
    :param planning: makes what plans for the environment of that name; None: planners.
    :param connections: makes what carries the messages of the feature protobuf; None: sockets.
    """

    features: tuple[Feature, ...] = ()
    executors: tuple[type[SkillExecutor], ...] = ()
    writers: tuple[RunWriter, ...] = ()
    planning: Callable[[str], PlanningService] | None = None
    connections: MakeConnections | None = None


NOTHING = Additions()
