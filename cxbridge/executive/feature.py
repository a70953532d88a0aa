"""Features: functions, templates and rules for CLIPS environments, which request them by name.

The module has the base class of features, features that are imported on request, and functions that log their
errors.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING

from msgspec import Struct

from cxbridge.errors import CxbridgeError

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value


class Feature(ABC):
    """The base class of features.

    Subclasses have a name and define functions in :meth:`init_context`::

        class Answer(Feature):
            name = "answer"

            def init_context(self, env: ClipsEnvironment) -> None:
                env.define("answer", lambda: 42)
    """

    name: str
    """The argument of ``(ff-feature-request ...)``."""

    @abstractmethod
    def init_context(self, env: ClipsEnvironment) -> None:
        """Add the feature to an environment. Called once per environment."""

    def before_run(self, env: ClipsEnvironment) -> None:  # noqa: B027  optional
        """Assert new input, e.g. from other threads, before the rules run.

        Called once in each loop, while the caller holds the environment's lock.
        """

    def context_destroyed(self, env: ClipsEnvironment) -> None:  # noqa: B027  optional
        """Release the resources of an environment before it is destroyed."""


class LazyFeature(Struct, frozen=True):
    """A feature that is imported on request, to keep the start of a run fast.

    :param name: the argument of ``(ff-feature-request ...)``.
    :param load: imports and makes the feature; may raise ``CxbridgeError``.
    :param origin: module and plug-in of the feature; empty for cxbridge's features.
    """

    name: str
    load: Callable[[], Feature]
    origin: str = ""


def define_logged(
    env: ClipsEnvironment,
    name: str,
    function: Callable[..., Value],
    types: str,
    failure: Value,
    log_error: Callable[[CxbridgeError], None],
) -> None:
    """Define a method as a CLIPS function that logs its errors. As in Fawkes, the right-hand side continues.

    :param function: the bound method, whose parameters are the arguments of the CLIPS function.
    :param types: the types of the arguments, see ``UdfTable.define``.
    :param failure: the result after an error.
    :param log_error: gets each ``CxbridgeError``. Other exceptions are faults of the method, see
        ``ClipsEnvironment.faults``.
    """

    @wraps(function)
    def call(*arguments: Value) -> Value:
        try:
            return function(*arguments)
        except CxbridgeError as error:
            log_error(error)
            return failure

    env.define(name, call, function.__code__.co_argcount - 1, types=types)  # self is not an argument
