"""A robot memory in a dict, for tests of CLIPS files: documents, collections, events, mutexes.

The functions are those of Fawkes' CLIPS feature robot_memory. Results of Fawkes' other threads (events,
answers to asynchronous operations) wait until the test calls :meth:`deliver`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, Symbol, Value
from tests.executive.core.core_bench import Bench

MUTEXES = "robmem_coordination.mutex"

Document = dict[str, Any]


@dataclass(frozen=True, order=True)
class Date:
    """A time in a document, in milliseconds."""

    ms: int


class FakeRobotMemory:
    """The feature, for one environment.

    :param env: gets the functions.
    """

    def __init__(self, env: ClipsEnvironment) -> None:
        self.env = env
        self.collections: dict[str, dict[str, Document]] = {}
        self.calls: list[tuple[str, tuple[Value, ...]]] = []
        self.destroyed_triggers: list[Value] = []
        self.refuse_triggers = 0
        self.fail_mutex_operations = False
        self._living: dict[int, Any] = {}
        self._handles = 0
        self._pending: list[Callable[[], object]] = []
        self._triggers: dict[str, str] = {}
        self._seconds = 1000
        for name in (name for name in dir(self) if name.startswith(("do_bson_", "do_robmem_"))):
            env.define(name[3:].replace("_", "-"), self._recorded(name), 0, 9)

    def _recorded(self, name: str) -> Callable[..., Value]:
        function = getattr(self, name)

        def call(*args: Value) -> Value:
            self.calls.append((name[3:].replace("_", "-"), args))
            result: Value = function(*args)
            return result

        return call

    # --- for the test -------------------------------------------------------------------------------------

    def handle(self, thing: Any) -> ExternalAddress:
        """Make something that CLIPS can carry around."""
        self._handles += 1
        self._living[self._handles] = thing
        return ExternalAddress(self._handles)

    def living(self) -> int:
        """Count the documents, arrays and cursors that are not destroyed."""
        return len(self._living)

    def deliver(self) -> None:
        """Assert the answers and events of Fawkes' other threads."""
        pending, self._pending = self._pending, []
        for action in pending:
            action()

    def event(self, collection: str, kind: str, document: Document, clock: int | None = None) -> None:
        """Queue the event of a change of the collection, if a trigger is registered."""
        name = self._triggers.get(collection)
        if name is not None:
            self._seconds += 1
            change: Document = {"operationType": kind, "documentKey": {"_id": document.get("_id")}}
            change["clusterTime"] = Date((clock or self._seconds) * 1000)
            if kind != "delete":
                change["fullDocument"] = dict(document)
            received = (self._seconds, 0)
            self._pending.append(lambda: self.trigger(name, change, received))

    def trigger(self, name: str, change: Document, received: tuple[int, int] = (1, 0)) -> None:
        """Assert the facts of an event."""
        slots = {"name": name, "rcvd-at": received, "ptr": self.handle(change)}
        self.env.assert_fact("robmem-trigger", slots)

    def lock(self, mutex: str, owner: str, seconds: int = 0) -> None:
        """Lock a mutex for an owner."""
        self._put_mutex(mutex, {"locked": True, "locked-by": owner, "lock-time": Date(seconds * 1000)})

    def unlock(self, mutex: str) -> None:
        """Unlock a mutex."""
        self._put_mutex(mutex, {"locked": False})

    def _put_mutex(self, mutex: str, fields: Document) -> None:
        known = self.collections.setdefault(MUTEXES, {})
        kind = "update" if mutex in known else "insert"
        known[mutex] = {"_id": mutex, **fields}
        self.event(MUTEXES, kind, known[mutex])

    def called(self, name: str) -> list[tuple[Value, ...]]:
        """Return the arguments of all calls of a function."""
        return [args for called, args in self.calls if called == name]

    # --- documents ----------------------------------------------------------------------------------------

    def _of(self, address: Value) -> Any:
        assert isinstance(address, ExternalAddress), address
        return self._living[address.handle]

    def _in(self, value: Value) -> Any:
        return dict(self._of(value)) if isinstance(value, ExternalAddress) else value

    def _out(self, value: Any) -> Value:
        if isinstance(value, bool):
            return TRUE if value else FALSE
        if isinstance(value, dict):
            return self.handle(dict(value))
        if isinstance(value, str):
            return str(value)
        return value if isinstance(value, int | float) else Symbol("INVALID_VALUE_TYPE")

    def _field(self, doc: Value, path: str) -> Any:
        found: Any = self._of(doc)
        for part in str(path).split("."):
            if not isinstance(found, dict) or part not in found:
                return None
            found = found[part]
        return found

    def do_bson_create(self) -> Value:
        return self.handle({})

    def do_bson_destroy(self, doc: Value) -> None:
        assert isinstance(doc, ExternalAddress)
        del self._living[doc.handle]

    def do_bson_tostring(self, doc: Value) -> Value:
        return str(self._of(doc))

    def do_bson_append(self, doc: Value, field: str, value: Value) -> None:
        self._of(doc)[str(field)] = self._in(value)

    def do_bson_append_regex(self, doc: Value, field: str, regex: str) -> None:
        self._of(doc)[str(field)] = re.compile(regex)

    def do_bson_append_array(self, doc: Value, field: str, values: tuple[Value, ...]) -> None:
        self._of(doc)[str(field)] = [self._in(value) for value in values]

    def do_bson_append_time(self, doc: Value, field: str, time: tuple[int, int]) -> None:
        self._of(doc)[str(field)] = Date(time[0] * 1000 + time[1] // 1000)

    def do_bson_has_field(self, doc: Value, field: str) -> Value:
        return TRUE if self._field(doc, field) is not None else FALSE

    def do_bson_field_names(self, doc: Value) -> Value:
        return tuple(str(name) for name in self._of(doc))

    def do_bson_get(self, doc: Value, field: str) -> Value:
        found = self._field(doc, field)
        if found is None:
            self.env.log.warn(f"no field {field}")
            return FALSE
        return self._out(found)

    def do_bson_get_array(self, doc: Value, field: str) -> Value:
        found = self._field(doc, field)
        return tuple(self._out(value) for value in found) if isinstance(found, list) else (FALSE,)

    def do_bson_get_time(self, doc: Value, field: str) -> Value:
        found = self._field(doc, field)
        return (found.ms // 1000, found.ms % 1000 * 1000) if isinstance(found, Date) else (FALSE,)

    # --- collections --------------------------------------------------------------------------------------

    @staticmethod
    def _fits(document: Document, query: Document) -> bool:
        for field, wanted in query.items():
            value = document.get(field)
            if isinstance(wanted, re.Pattern):
                if not wanted.search(str(value)):
                    return False
            elif isinstance(wanted, dict) and "$lte" in wanted:
                if not value <= wanted["$lte"]:
                    return False
            elif value != wanted:
                return False
        return True

    def _find(self, collection: str, query: Document) -> list[Document]:
        return [doc for doc in self.collections.get(collection, {}).values() if self._fits(doc, query)]

    def do_robmem_upsert(self, collection: str, doc: Value, query: Value) -> None:
        new = dict(self._of(doc))
        known = self.collections.setdefault(collection, {})
        found = self._find(collection, self._of(query))
        key = str(new.get("_id", f"made-{len(known)}"))
        if not found and key in known:
            self.env.log.warn("Upsert failed: duplicate key")
            return
        for old in found:
            old.update(new)
        if not found:
            known[key] = {"_id": key, **new}
        self.event(collection, "update" if found else "insert", found[0] if found else known[key])

    def do_robmem_remove(self, collection: str, query: Value) -> None:
        for doc in self._find(collection, self._of(query)):
            del self.collections[collection][str(doc["_id"])]
            self.event(collection, "delete", doc)

    def do_robmem_query(self, collection: str, query: Value) -> Value:
        return self.handle(list(self._find(collection, self._of(query))))

    def do_robmem_query_sort(self, collection: str, query: Value, sort: Value) -> Value:
        found = self._find(collection, self._of(query))
        for field, direction in self._of(sort).items():
            found.sort(key=lambda doc: str(doc[field]), reverse=direction < 0)
        return self.handle(found)

    def do_robmem_cursor_next(self, cursor: Value) -> Value:
        documents = self._of(cursor)
        return self._out(documents.pop(0)) if documents else FALSE

    def do_robmem_cursor_destroy(self, cursor: Value) -> None:
        self.do_bson_destroy(cursor)

    def do_robmem_trigger_register(self, collection: str, query: Value, name: str) -> Value:
        assert self._of(query) == {}
        answer = f'SUCCESS "{name}" 0x{len(self._triggers) + 1}'
        if self.refuse_triggers > 0:
            self.refuse_triggers -= 1
            answer = f'FAIL "{name}"'
        else:
            self._triggers[collection] = name
        self._pending.append(lambda: self.env.assert_string(f"(mutex-trigger-register-feedback {answer})"))
        return TRUE

    def do_robmem_trigger_destroy(self, trigger: Value) -> None:
        self.destroyed_triggers.append(trigger)

    # --- mutexes ------------------------------------------------------------------------------------------

    def _answer(self, operation: str, *rest: str) -> None:
        fact = f"(mutex-op-feedback {operation} {' '.join(rest)})"
        self._pending.append(lambda: self.env.assert_string(fact))

    def do_robmem_mutex_create_async(self, name: str) -> Value:
        self.unlock(name)
        return (TRUE,)

    def do_robmem_mutex_try_lock_async(self, name: str, identity: str) -> Value:
        held = self.collections.get(MUTEXES, {}).get(name, {}).get("locked", False)
        if held or self.fail_mutex_operations:
            self._answer("try-lock-async", "FAIL", name)
        else:
            self.lock(name, str(identity), self._seconds)
        return (TRUE,)

    def do_robmem_mutex_renew_lock_async(self, name: str, identity: str) -> Value:
        document = self.collections.get(MUTEXES, {}).get(name, {})
        if document.get("locked-by") != identity or self.fail_mutex_operations:
            self._answer("renew-lock-async", "FAIL", name)
        else:
            self.lock(name, str(identity), self._seconds)
            self._answer("renew-lock-async", "OK", name)
        return (TRUE,)

    def do_robmem_mutex_unlock_async(self, name: str, identity: str) -> Value:
        if self.collections.get(MUTEXES, {}).get(name, {}).get("locked-by") == identity:
            self.unlock(name)
        return (TRUE,)

    def do_robmem_mutex_expire_locks_async(self, max_age: float) -> Value:
        self._answer("expire-locks-async", "FAIL" if self.fail_mutex_operations else "OK")
        return TRUE


class MemoryBench(Bench):
    """A bench whose environment has a robot memory.

    :param files: names below ``clips/cx``, executed in this order after the definition of the robot memory.
    """

    def __init__(self, *files: str) -> None:
        super().__init__()
        self.memory = FakeRobotMemory(self.env)
        for name in files:
            self.load(f"cx/{name}")

    def settle(self) -> None:
        """Deliver and run until no answer or event is left."""
        for _ in range(6):
            self.memory.deliver()
            assert self.env.run(500) < 500
