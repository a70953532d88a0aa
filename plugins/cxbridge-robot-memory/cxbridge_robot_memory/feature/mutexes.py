"""The ``robmem-mutex-*`` functions for locks that agents share.

Most functions have two variants. The variant without ``-async`` waits for the database. The variant with
``-async`` does not wait for a database outside of this process; a fact in a later run of the rules reports
some of the results, see :meth:`MutexFunctions._queue_feedback`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value
from cxbridge_robot_memory.feature.context import FAIL, OK, RobotMemoryContext
from cxbridge_robot_memory.mutexes import Mutexes

_FEEDBACK_RELATION = "mutex-op-feedback"
_EXPIRE_OPERATION = "expire-locks-async"


class MutexFunctions:
    """Defines the functions in an environment."""

    def __init__(self, env: ClipsEnvironment, context: RobotMemoryContext) -> None:
        self._context = context
        memory = context.memory
        self._mutexes = mutexes = Mutexes(context.store, memory.settings.mutex_collection, memory.clock)
        operations: tuple[tuple[str, Callable[..., bool], int], ...] = (
            ("create", mutexes.create, 1),
            ("destroy", mutexes.destroy, 1),
            ("try-lock", mutexes.try_lock, 2),
            ("renew-lock", mutexes.renew, 2),
            ("force-lock", partial(mutexes.try_lock, force=True), 2),
            ("unlock", mutexes.unlock, 2),
        )
        for name, operation, argument_count in operations:
            self._define(env, name, operation, argument_count)
        # the age of the locks is an integer or a float (ld)
        self._define_waiting(env, "setup-ttl", mutexes.setup_ttl, "*;ld")
        self._define_waiting(env, "expire-locks", mutexes.expire, "*;ld")
        env.define("robmem-mutex-expire-locks-async", self._expire_async, 1, types="*;ld")

    def _define(
        self, env: ClipsEnvironment, name: str, operation: Callable[..., bool], argument_count: int
    ) -> None:
        """Define both variants of a function.

        :param operation: the method of :class:`Mutexes`.
        :param argument_count: the number of arguments: the mutex, and perhaps the identity of the owner.
        """
        # CLIPS' codes: any type by default, and a string or symbol (sy) for each argument
        types = ";".join(["*", *["sy"] * argument_count])
        self._define_waiting(env, name, operation, types)
        env.define(
            f"robmem-mutex-{name}-async",
            lambda *names: self._start_async(name, operation, *names),
            argument_count,
            types=types,
        )

    def _define_waiting(
        self, env: ClipsEnvironment, name: str, operation: Callable[..., bool], types: str
    ) -> None:
        """Define the variant of a function that waits for the database.

        :param types: CLIPS' codes for the types: the default, then each argument's after a semicolon.
        """
        env.define(
            f"robmem-mutex-{name}",
            lambda *values: self._perform(name, operation, *values),
            types.count(";"),
            types=types,
        )

    def _perform(self, name: str, operation: Callable[..., bool], *arguments: Value) -> Value:
        """Perform an operation; return its result as TRUE or FALSE, and FALSE after an error."""
        return TRUE if self._context.try_operation(f"Mutex {name}", partial(operation, *arguments)) else FALSE

    def _start_async(self, name: str, operation: Callable[..., bool], mutex: str, *identity: Value) -> Value:
        """Start an operation, unless another operation on the mutex is running.

        :returns: TRUE, or FALSE with the reason, as a multifield.
        """

        def run() -> None:
            is_successful = self._context.try_operation(f"Mutex {name}", partial(operation, mutex, *identity))
            self._queue_feedback(name, mutex, is_successful=is_successful)

        if self._context.start_operation(f"mutex {mutex}", run):
            return (TRUE,)
        self._queue_feedback(name, mutex, is_successful=False)
        return (FALSE, f"Task already running for {mutex} ({name} failed)")

    def _queue_feedback(self, name: str, mutex: str, *, is_successful: bool) -> None:
        """Queue a fact with the outcome of an operation, if Fawkes has such a fact for the outcome.

        Agents learn the remaining outcomes from the trigger on the collection of mutexes.
        """
        if name == "renew-lock" or (name == "try-lock" and not is_successful):
            self._context.enqueue_fact(
                _FEEDBACK_RELATION, Symbol(f"{name}-async"), OK if is_successful else FAIL, Symbol(mutex)
            )

    def _expire_async(self, max_age_s: float) -> Value:
        """Start to open old mutexes; return FALSE if the previous call is still running, TRUE otherwise."""

        def run() -> None:
            is_successful = self._context.try_operation(
                "Expiring locks", partial(self._mutexes.expire, max_age_s)
            )
            self._context.enqueue_fact(
                _FEEDBACK_RELATION, Symbol(_EXPIRE_OPERATION), OK if is_successful else FAIL
            )

        if self._context.start_operation(_EXPIRE_OPERATION, run):
            return TRUE
        self._context.enqueue_fact(_FEEDBACK_RELATION, Symbol(_EXPIRE_OPERATION), FAIL)
        return FALSE
