"""The world model of a run for clients: one feature for rules and for the servers of experts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cxbridge_ros2.problem_expert import ProblemExpertFeature

if TYPE_CHECKING:
    from cxbridge.run.context import RunContext


class SharedExperts:
    """The feature that the rules and the servers of a run share.

    :param context: of the run.
    """

    def __init__(self, context: RunContext) -> None:
        self.feature = ProblemExpertFeature(context.pddl_parser.domain_of)


def problem_expert(context: RunContext) -> ProblemExpertFeature:
    """Return the feature of a run."""
    return context.one_of(SharedExperts).feature
