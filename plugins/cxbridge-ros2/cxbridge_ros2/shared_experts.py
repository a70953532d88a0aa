"""The world model of a run as others see and edit it: one for its rules and for the servers of experts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from cxbridge.executive.features.planning_base import DomainOf
    from cxbridge_ros2.problem_expert import ProblemExpertFeature


class SharedExperts:
    """Makes the feature for the first who asks."""

    name: Final = "problem-expert"
    """What the feature is called."""

    section: Final = "/ros2/experts"
    """The part of the configuration with which an agent has it unasked."""

    def __init__(self) -> None:
        self._feature: ProblemExpertFeature | None = None

    def feature(self, domain_of: DomainOf) -> ProblemExpertFeature:
        """Return the feature.

        :param domain_of: returns the domain that an environment parsed last.
        """
        if self._feature is None:
            from cxbridge_ros2.problem_expert import ProblemExpertFeature  # noqa: PLC0415

            self._feature = ProblemExpertFeature(domain_of)
        return self._feature
