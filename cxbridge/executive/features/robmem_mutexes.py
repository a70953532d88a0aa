"""The ``robmem-mutex-*`` functions. Variants with ``-async`` report their result as a fact in a later run."""

from __future__ import annotations

from collections.abc import Callable

from cxbridge.executive.features.robmem_context import FAIL, OK, RobotMemoryContext
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value
from cxbridge.executive.robmem.mutexes import Mutexes

_FEEDBACK = "mutex-op-feedback"
_EXPIRE = "expire-locks-async"


class MutexFunctions:
    def __init__(self, env: ClipsEnvironment, context: RobotMemoryContext) -> None:
        self._context = context
        memory = context.memory
        self._mutexes = mutexes = Mutexes(context.store, memory.settings.mutexes, memory.clock)
        self._define_named(env, "create", mutexes.create)
        self._define_named(env, "destroy", mutexes.destroy)
        self._define_owned(env, "try-lock", mutexes.try_lock)
        self._define_owned(env, "renew-lock", mutexes.renew)
        self._define_owned(env, "force-lock", lambda name, owner: mutexes.try_lock(name, owner, force=True))
        self._define_owned(env, "unlock", mutexes.unlock)
        for name, operation in (("setup-ttl", mutexes.setup_ttl), ("expire-locks", mutexes.expire)):
            env.define(f"robmem-mutex-{name}", self._with_age(name, operation), 1, types="*;ld")
        env.define("robmem-mutex-expire-locks-async", self._expire_async, 1, types="*;ld")

    def _define_named(self, env: ClipsEnvironment, name: str, operation: Callable[[str], bool]) -> None:
        def at_once(mutex: str) -> Value:
            return self._result(name, lambda: operation(mutex))

        def later(mutex: str) -> Value:
            return self._later(name, mutex, lambda: operation(mutex))

        env.define(f"robmem-mutex-{name}", at_once, 1, types="*;sy")
        env.define(f"robmem-mutex-{name}-async", later, 1, types="*;sy")

    def _define_owned(self, env: ClipsEnvironment, name: str, operation: Callable[[str, str], bool]) -> None:
        def at_once(mutex: str, identity: str) -> Value:
            return self._result(name, lambda: operation(str(mutex), str(identity)))

        def later(mutex: str, identity: str) -> Value:
            return self._later(name, mutex, lambda: operation(str(mutex), str(identity)))

        env.define(f"robmem-mutex-{name}", at_once, 2, types="*;sy;sy")
        env.define(f"robmem-mutex-{name}-async", later, 2, types="*;sy;sy")

    def _with_age(self, name: str, operation: Callable[[float], bool]) -> Callable[[float], Value]:
        return lambda seconds: self._result(name, lambda: operation(float(seconds)))

    def _result(self, name: str, operation: Callable[[], bool]) -> Value:
        return TRUE if self._context.attempt(f"Mutex {name}", operation) else FALSE

    def _later(self, name: str, mutex: str, operation: Callable[[], bool]) -> Value:
        """Start an operation, unless the mutex has a running one."""

        def run() -> None:
            self._report(name, mutex, done=self._context.attempt(f"Mutex {name}", operation))

        if self._context.start(f"mutex {mutex}", run):
            return (TRUE,)
        self._report(name, mutex, done=False)
        return (FALSE, f"Task already running for {mutex} ({name} failed)")

    def _report(self, name: str, mutex: str, *, done: bool) -> None:
        """Assert the outcomes that Fawkes reports.

        The trigger on the collection reports the remaining ones.
        """
        if name == "renew-lock" or (name == "try-lock" and not done):
            self._context.enqueue_fact(
                _FEEDBACK, Symbol(f"{name}-async"), OK if done else FAIL, Symbol(mutex)
            )

    def _expire_async(self, seconds: float) -> Value:
        def run() -> None:
            done = self._context.attempt("Expiring locks", lambda: self._mutexes.expire(float(seconds)))
            self._context.enqueue_fact(_FEEDBACK, Symbol(_EXPIRE), OK if done else FAIL)

        if self._context.start(_EXPIRE, run):
            return TRUE
        self._context.enqueue_fact(_FEEDBACK, Symbol(_EXPIRE), FAIL)
        return FALSE
