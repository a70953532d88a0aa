"""Coordination in the built-in core: mutexes, and the actions that lock and unlock them.

The tables are those of the compatibility page on the behaviour of the CX core, sections 8.2 and 8.3.
"""

from __future__ import annotations

import pytest

from cxbridge.executive.host.values import Symbol, Value
from tests.executive.fake_robot_memory import MemoryBench

FILES = (
    "plan.clp",
    "goal.clp",
    "worldmodel.clp",
    "cx-identity.clp",
    "robot-memory.clp",
    "coordination-mutex.clp",
    "lock-actions.clp",
    "resource-locks.clp",
)


class CoordinationBench(MemoryBench):
    """A robot `me` with a robot memory; the trigger is registered."""

    def __init__(self) -> None:
        super().__init__(*FILES)
        self.env.call("cx-identity-set", "me")
        self.env.assert_string("(executive-init)")
        self.env.run()
        self.settle()

    def mutex(self, name: str = "m") -> dict[str, Value]:
        """Return the slots of a mutex."""
        return self.one("mutex", name=name)

    def answer(self, name: str = "m") -> tuple[str, str, str, str]:
        """Return request, response, state and owner of a mutex."""
        mutex = self.mutex(name)
        return tuple(str(mutex[slot]) for slot in ("request", "response", "state", "locked-by"))  # type: ignore[return-value]

    def call(self, function: str, *args: str) -> None:
        """Call a function with symbols, and run."""
        self.env.call(function, *map(Symbol, args))
        self.env.run()

    def acquire_own(self, name: str = "m") -> None:
        """Acquire a mutex and reset its response."""
        self.call("mutex-try-lock-async", name)
        self.settle()
        assert self.answer(name) == ("LOCK", "ACQUIRED", "LOCKED", "me")
        self.reset(name)

    def reset(self, name: str = "m") -> None:
        """Reset a response, as the requesting agent has to."""
        self.modify("mutex", "(request NONE) (response NONE)", name=name)
        self.env.run()

    def lock_as_other(self, name: str = "m") -> None:
        """Let another robot lock a mutex."""
        self.memory.lock(name, "other")
        self.settle()

    def problems(self) -> list[str]:
        """Return the error messages that mutexes reported."""
        texts = (text.partition("reported an error: ") for text in self.texts("W"))
        return [message for _, found, message in texts if found]


@pytest.fixture
def bench() -> CoordinationBench:
    return CoordinationBench()


def test_lock_without_request_is_released(bench: CoordinationBench) -> None:
    bench.memory.unlock("m")
    bench.settle()
    bench.memory.lock("m", "me")
    bench.settle()
    assert bench.texts("E") == ["Acquired a mutex without a request, releasing the mutex again!"]
    assert bench.memory.called("robmem-mutex-unlock-async") == [("m", "me")]
    assert bench.mutex()["state"] == "OPEN"


# --- UNLOCK -----------------------------------------------------------------------------------------------


def test_unlock_of_foreign_lock_is_refused(bench: CoordinationBench) -> None:
    bench.lock_as_other()
    bench.call("mutex-unlock-async", "m")
    assert bench.mutex()["response"] == "ERROR"
    assert bench.problems() == ["Lock held by other. Cannot release foreign lock."]
    bench.modify("mutex", "(response NONE)", name="m")
    bench.env.run()
    assert bench.problems()[1:] == ["Locked by other (and not by us)"]
    assert bench.memory.called("robmem-mutex-unlock-async") == []


# --- RENEW-LOCK -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("prepare", "problem"),
    [
        ("theirs", "Lock held by other. Cannot renew foreign lock."),
        ("opened", "Mutex m not LOCKED. Cannot renew."),
        ("busy", "Mutex m already has pending UNLOCK request."),
    ],
)
def test_renewal_of_foreign_lock_is_refused(bench: CoordinationBench, prepare: str, problem: str) -> None:
    if prepare == "opened":
        bench.memory.unlock("m")
        bench.settle()
    elif prepare == "busy":
        bench.acquire_own()
        bench.call("mutex-unlock-async", "m")
    else:
        bench.lock_as_other()
    bench.call("mutex-renew-lock-async", "m")
    assert bench.mutex()["response"] == "ERROR"
    assert bench.problems()[0].startswith(problem)


@pytest.fixture
def renewing() -> CoordinationBench:
    """An own lock with a renewal in progress."""
    bench = CoordinationBench()
    bench.env.assert_string(
        '(wm-fact (id "/config/coordination/mutex/renew-interval") (type UINT) (value 5))'
    )
    bench.acquire_own()
    bench.tick()
    assert bench.answer() == ("RENEW-LOCK", "PENDING", "LOCKED", "me")
    return bench


def test_fresh_lock_is_not_renewed(bench: CoordinationBench) -> None:
    bench.env.assert_string(
        '(wm-fact (id "/config/coordination/mutex/renew-interval") (type UINT) (value 5))'
    )
    bench.acquire_own()
    now = bench.clock.now_us() // 1_000_000
    bench.modify("mutex", f"(lock-time {now - 5} 0)", name="m")
    bench.tick()
    assert bench.mutex()["request"] == "NONE"
    bench.tick(0.1)
    assert bench.mutex()["request"] == "RENEW-LOCK"


def test_unlock_waits_for_renewal(renewing: CoordinationBench) -> None:
    renewing.call("mutex-unlock-async", "m")
    assert renewing.mutex()["pending-requests"] == ("AUTO-RENEW-PROC", "UNLOCK")
    renewing.settle()
    assert renewing.answer() == ("UNLOCK", "UNLOCKED", "OPEN", "")


def test_failed_renewal_loses_lock(renewing: CoordinationBench) -> None:
    renewing.memory._pending.clear()
    renewing.env.assert_string("(mutex-op-feedback renew-lock-async FAIL m)")
    renewing.env.run()
    assert renewing.answer() == ("NONE", "NONE", "LOCKED", "lost")
    assert renewing.texts("E") == ["Renewing lock for mutex m failed. LOST LOCK!"]


def test_renewal_reports_lock_of_another_agent(renewing: CoordinationBench) -> None:
    renewing.memory._pending.clear()
    renewing.lock_as_other()
    assert renewing.answer() == ("NONE", "NONE", "LOCKED", "other")
    assert "but lock is locked by other" in renewing.texts("E")[0]


# --- expiry -----------------------------------------------------------------------------------------------


def test_expiry_uses_configured_age(bench: CoordinationBench) -> None:
    bench.env.assert_string('(wm-fact (id "/config/coordination/mutex/max-age-sec") (type UINT) (value 15))')
    bench.call("mutex-expire-locks-async")
    bench.settle()
    task = bench.one("mutex-expire-task")
    assert (task["task"], task["state"], task["max-age-sec"]) == ("EXPIRE", "COMPLETED", 15.0)


# --- actions ----------------------------------------------------------------------------------------------


def _action(bench: CoordinationBench, name: str, executable: bool = True) -> None:
    params = "(param-names name) (param-values m)" if name in ("lock", "unlock") else ""
    flag = str(executable).upper()
    bench.env.assert_string(
        f"(plan-action (id 1) (plan-id p) (action-name {name}) (state PENDING) (executable {flag}) {params})"
    )
    bench.env.run()


def _state(bench: CoordinationBench) -> tuple[str, str]:
    action = bench.one("plan-action")
    return str(action["state"]), str(action["error-msg"])


def test_refused_lock_fails_lock_action(bench: CoordinationBench) -> None:
    bench.memory.fail_mutex_operations = True
    _action(bench, "lock")
    bench.settle()
    assert _state(bench) == ("EXECUTION-FAILED", "Lock held by 'unknown'")
    assert bench.mutex()["request"] == "NONE"


@pytest.mark.parametrize("name", ["flush-locks", "expire-locks"])
@pytest.mark.parametrize("fails", [False, True])
def test_flush_and_expire_actions(bench: CoordinationBench, name: str, fails: bool) -> None:
    bench.env.assert_string(
        '(wm-fact (id "/config/coordination/mutex/max-age-sec") (type FLOAT) (value 15.0))'
    )
    bench.memory.fail_mutex_operations = fails
    _action(bench, name)
    assert _state(bench) == ("RUNNING", "")
    bench.settle()
    assert _state(bench) == ("EXECUTION-FAILED" if fails else "EXECUTION-SUCCEEDED", "")
    assert bench.all("mutex-expire-task") == []


@pytest.mark.parametrize("name", ["lock", "unlock", "flush-locks", "expire-locks"])
def test_actions_wait_until_executable(bench: CoordinationBench, name: str) -> None:
    _action(bench, name, executable=False)
    assert _state(bench) == ("PENDING", "")


def test_events_are_handled_in_order_of_arrival(bench: CoordinationBench) -> None:
    for owner, second in (("late", 30), ("early", 10), ("middle", 20)):
        document = {"_id": "m", "locked": True, "locked-by": owner}
        bench.memory.trigger(
            "mutex-trigger", {"operationType": "update", "fullDocument": document}, (second, 0)
        )
    bench.env.run()
    assert bench.mutex()["locked-by"] == "late"
    assert bench.memory.living() == 0
