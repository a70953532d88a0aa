"""The base class of features, and the forms in which an environment manager is offered one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING

from msgspec import Struct

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment


class Feature(ABC):
    """Something an environment can request.

    Subclass it, name it, and define functions in :meth:`init_context`::

        class Answer(Feature):
            name = "answer"

            def init_context(self, env: ClipsEnvironment) -> None:
                env.define("answer", lambda: 42)
    """

    name: str
    """What ``(ff-feature-request ...)`` calls it."""

    @abstractmethod
    def init_context(self, env: ClipsEnvironment) -> None:
        """Give the environment the feature's functions, templates and rules. Called once an environment."""

    def before_run(self, env: ClipsEnvironment) -> None:  # noqa: B027  most features wait for nothing
        """Report new input to the environment since its last run, e.g. from other threads.

        Called before each run of its rules, once a loop, with its lock held.
        """

    def context_destroyed(self, env: ClipsEnvironment) -> None:  # noqa: B027  most features hold nothing
        """Release the environment's resources. Called before it is destroyed."""


class LazyFeature(Struct, frozen=True):
    """A feature that is imported when an environment requests the feature: start-up time is a feature.

    :param name: the feature's name.
    :param load: imports and makes the feature; raises ``CxbridgeError`` when that fails.
    :param origin: the module and the plug-in of the feature; empty for features of cxbridge.
    """

    name: str
    load: Callable[[], Feature]
    origin: str = ""
