"""The base class of features, and the forms in which an environment manager is offered one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from msgspec import Struct

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.config import Configuration
    from cxbridge.events import EventBus
    from cxbridge.executive.host.environment import ClipsEnvironment


class FeatureContext(Struct, frozen=True):
    """What a plug-in may use.

    :param config: the configuration of the run or daemon.
    :param board: its blackboard.
    :param bus: takes log lines and events; has the clock.
    :param substitutions: what ``@BASEDIR@`` and its like stand for.
    :param folder: the configuration's; relative paths in it are seen from there.
    """

    config: Configuration
    board: BlackBoard
    bus: EventBus
    substitutions: Mapping[str, str]
    folder: Path


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

    @classmethod
    def make(cls, context: FeatureContext) -> Feature:  # noqa: ARG003  most need nothing
        """Return an instance for a run or daemon; a plug-in that needs the run's context overrides it."""
        return cls()

    @abstractmethod
    def init_context(self, env: ClipsEnvironment) -> None:
        """Give the environment what the feature consists of. Called once an environment."""

    def before_run(self, env: ClipsEnvironment) -> None:  # noqa: B027  most features wait for nothing
        """Report to the environment what came in since its last run, e.g. from other threads.

        Called before each run of its rules, once a loop, with its lock held.
        """

    def context_destroyed(self, env: ClipsEnvironment) -> None:  # noqa: B027  most features hold nothing
        """Let go of what is held for the environment. Called before it is destroyed."""


class Plugin(Protocol):
    """A feature that is not made before an environment asks for it."""

    @property
    def name(self) -> str:
        """What the feature is called."""

    def load(self) -> Feature:
        """Make the feature.

        :raises ClipsError: when that fails.
        """


class LazyFeature(Struct, frozen=True):
    """A feature of this package that is imported when an environment asks for it: start-up time is a feature.

    :param name: what the feature is called.
    :param load: imports and makes it.
    """

    name: str
    load: Callable[[], Feature]
