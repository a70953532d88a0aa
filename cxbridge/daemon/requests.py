"""A daemon takes requests to its executive: debugger and environments, over its blackboard."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

from cxbridge.daemon.board import DAEMON_ID, OWNER, REQUEST_TYPE
from cxbridge.daemon.components import component_row
from cxbridge.daemon.state import DaemonState
from cxbridge.errors import CxbridgeError, ExecutiveError
from cxbridge.executive.host.loggers import ABOVE
from cxbridge.printing import one_line
from cxbridge.rights import Right, Rights, right_of_verb

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.daemon.components import DaemonComponents
    from cxbridge.daemon.nodes import ExecutiveNode
    from cxbridge.events import EventBus
    from cxbridge.executive.breakpoints import Breakpoint, Stop
    from cxbridge.executive.debugger import Debugger
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.service import EnvironmentService

MOST_REQUESTS: Final = 16
"""Requests that may wait."""

MOST_ROWS: Final = 1000
"""Facts or activations in an answer."""

_ANSWER_BYTES: Final = 262_143
_REASON_BYTES: Final = 1000
_SEARCH_S: Final = 0.005
_LOGGED: Final = 500


class DaemonRequests:
    """Takes requests and carries them out, one a loop.

    :param bus: what happens, for those who watch.
    :param node: the executive; None: there shall be none.
    :param rights: what clients may do.
    :param components: the daemon's, in the order of their start.
    """

    def __init__(
        self,
        board: BlackBoard,
        bus: EventBus,
        node: ExecutiveNode | None,
        rights: Rights,
        components: DaemonComponents,
    ) -> None:
        # The fields of the interface come from its XML definition: there is no static type for them here.
        self._interface: Any = board.open_for_writing(
            REQUEST_TYPE, DAEMON_ID, owner=OWNER, queue_limit=MOST_REQUESTS
        )
        self._interface.write()
        self._log = bus.logger("Daemon")
        self._node = node
        self._rights = rights
        self._stop: Stop | None = None
        self._components = components
        self._state = DaemonState(bus, node)
        self._verbs: dict[str, Callable[[Mapping[str, Any]], Any]] = {
            "break-add": lambda given: [_row(self._add(str(spec))) for spec in given["specs"]],
            "break-remove": self._remove,
            "break-list": lambda _given: [_row(item) for item in self._debugger.breakpoints],
            "step": lambda given: self._debugger.step(str(given["what"])),
            "stop": lambda _given: self._debugger.stop(),
            "go-on": lambda _given: self._debugger.go_on(),
            "where": lambda _given: _stop_row(self._debugger.stopped),
            "state": self._tell_state,
            "facts": self._facts,
            "find-facts": self._find_facts,
            "agenda": self._agenda,
            "assert": self._assert,
            "retract": self._retract,
            "modify": self._modify,
            "env-list": lambda _given: [asdict(info) for info in self._service.list()],
            "env-create": self._create,
            "env-destroy": lambda given: self._service.destroy(str(given["env"])),
            "env-load": self._load,
            "env-feature-remove": lambda given: self._service.remove_feature(
                str(given["env"]), str(given["feature"])
            ),
            "env-loggers": lambda given: list(map(asdict, self._service.loggers(str(given["env"])))),
            "env-logger-add": self._add_logger,
            "env-logger-remove": lambda given: self._service.remove_logger(
                str(given["env"]), str(given["logger"])
            ),
            "feature-list": lambda _given: list(map(asdict, self._service.features())),
            "feature-offer": lambda given: self._service.offer_feature(str(given["feature"])),
            "feature-withdraw": lambda given: self._service.withdraw_feature(str(given["feature"])),
            "component-list": lambda _given: [component_row(each) for each in self._components.status()],
            "component-change": lambda given: self._components.change_one(
                str(given["component"]), str(given["transition"])
            ),
            "env-feature": lambda given: self._service.request_feature(
                str(given["env"]), str(given["feature"])
            ),
            "env-watch": self._watch,
            "env-eval": lambda given: asdict(
                self._service.evaluate(str(given["env"]), str(given["expression"]))
            ),
            "env-log": lambda given: self._service.set_log_level(str(given["env"]), str(given["level"])),
        }

    @property
    def _debugger(self) -> Debugger:
        return _there(self._executive.debugger)

    @property
    def _service(self) -> EnvironmentService:
        return _there(self._executive.service)

    @property
    def _executive(self) -> ExecutiveNode:
        """The executive.

        :raises ExecutiveError: when there shall be none.
        """
        if self._node is None:
            raise ExecutiveError("this daemon has no executive", hint="name a configuration with specs")
        return self._node

    def attend(self) -> None:
        """Tell where the rules are stopped, and carry out the next request. Called once a loop."""
        if not self._interface.valid:
            return
        self._tell_stop()
        message = self._interface.msgq_pop()
        if message is not None:
            self._answer(str(message.verb), str(message.token), str(message.arguments))
            self._tell_stop()

    def resume(self) -> None:
        """Go on where the rules are stopped."""
        if self._node is not None and self._node.debugger is not None:
            self._node.debugger.go_on()

    def _tell_stop(self) -> None:
        debugger = None if self._node is None else self._node.debugger
        stop = None if debugger is None else debugger.stopped
        if stop is self._stop:
            return
        self._stop = stop
        if stop is not None:
            self._interface.stops += 1
        reason = "" if stop is None else stop.reason
        self._interface.stopped = reason.encode("utf-8", "replace")[:_REASON_BYTES].decode("utf-8", "ignore")
        self._interface.write()

    def _answer(self, verb: str, token: str, arguments: str) -> None:
        try:
            answer: dict[str, Any] = {"result": self._carry_out(verb, arguments)}
        except CxbridgeError as error:
            answer = _refusal(error)
        except Exception as error:  # noqa: BLE001  nothing that is asked may end a daemon
            answer = _refusal(CxbridgeError(f"a fault of cxbridge: {type(error).__name__}: {error}"))
        text = json.dumps(answer | {"token": token})
        if len(text) > _ANSWER_BYTES:
            text = json.dumps(
                _refusal(CxbridgeError("the answer is too long", hint="ask for less")) | {"token": token}
            )
        self._interface.answer = text
        self._interface.mark_data_changed()
        self._interface.write()

    def _carry_out(self, verb: str, arguments: str) -> Any:
        """Carry out a request and return what is to be answered, as JSON can have it.

        :raises CxbridgeError: when it makes no sense, is not allowed, or cannot be done.
        """
        action = self._verbs.get(verb)
        if action is None:
            raise CxbridgeError(f"this daemon knows no request '{verb}'")
        if (right := right_of_verb(verb)) is not Right.LOOK:
            self._rights.check(right, verb)
            self._log.info(f"A client asks: {verb} {_in_one_line(arguments)}")
        given = _parse(verb, arguments)
        try:
            return action(given)
        except (KeyError, OverflowError, TypeError, ValueError) as error:
            raise CxbridgeError(f"the arguments of {verb} are wrong: {error!r}") from None

    # -- the debugger

    def _tell_state(self, given: Mapping[str, Any]) -> dict[str, Any]:
        node = self._node
        debugger, service = (None, None) if node is None else (node.debugger, node.service)
        return self._state.tell(given) | {
            "where": None if debugger is None else _stop_row(debugger.stopped),
            "breakpoints": [] if debugger is None else [_row(item) for item in debugger.breakpoints],
            "environments": [] if service is None else list(service.names),
        }

    def _add(self, spec: str) -> Breakpoint:
        from cxbridge.executive.breakpoints import parse_breakpoint  # noqa: PLC0415

        if parse_breakpoint(spec).condition:
            self._rights.check(Right.PROGRAMS, "the condition of a breakpoint")
        return self._debugger.add(spec)

    def _remove(self, given: Mapping[str, Any]) -> None:
        if given.get("all"):
            self._debugger.clear()
        for number in given.get("numbers", ()):
            self._debugger.remove(int(number))

    # -- facts, of any environment

    def _env(self, given: Mapping[str, Any]) -> ClipsEnvironment:
        return self._service.find(str(given["env"]))

    def _facts(self, given: Mapping[str, Any]) -> list[tuple[int, str]]:
        from cxbridge.executive.host.facts.editing import fact_texts  # noqa: PLC0415

        env = self._env(given)
        with env.lock:
            limit = min(int(given.get("limit", MOST_ROWS)), MOST_ROWS)
            return list(islice(fact_texts(env, str(given.get("template", ""))), limit))

    def _find_facts(self, given: Mapping[str, Any]) -> dict[str, Any]:
        from cxbridge.executive.host.facts.editing import find_facts  # noqa: PLC0415

        env = self._env(given)
        with env.lock:
            rows, after = find_facts(
                env,
                str(given.get("words", "")),
                int(given.get("after", 0)),
                min(int(given.get("limit", MOST_ROWS)), MOST_ROWS),
                _SEARCH_S,
            )
        return {"facts": rows, "after": after}

    def _agenda(self, given: Mapping[str, Any]) -> list[tuple[int, str, str]]:
        from cxbridge.executive.host.agenda import agenda  # noqa: PLC0415

        env = self._env(given)
        with env.lock:
            return list(islice(agenda(env), min(int(given.get("limit", MOST_ROWS)), MOST_ROWS)))

    def _assert(self, given: Mapping[str, Any]) -> int:
        from cxbridge.executive.host.facts.editing import assert_text  # noqa: PLC0415

        env = self._env(given)
        with env.lock:
            return assert_text(env, str(given["fact"]), constant=not self._rights.programs)

    def _retract(self, given: Mapping[str, Any]) -> None:
        from cxbridge.executive.host.facts.editing import retract_fact  # noqa: PLC0415

        env = self._env(given)
        with env.lock:
            retract_fact(env, int(given["index"]))

    def _modify(self, given: Mapping[str, Any]) -> int:
        from cxbridge.executive.host.facts.editing import modify_fact  # noqa: PLC0415

        env = self._env(given)
        with env.lock:
            slots = {str(slot): str(text) for slot, text in dict(given["slots"]).items()}
            return modify_fact(env, int(given["index"]), slots, constant=not self._rights.programs)

    # -- environments

    def _create(self, given: Mapping[str, Any]) -> None:
        self._service.create(str(given["env"]), str(given.get("log", "")))

    def _load(self, given: Mapping[str, Any]) -> list[str]:
        file = Path(str(given["file"]))
        return list(self._service.load(str(given["env"]), file, batch=bool(given.get("batch"))))

    def _watch(self, given: Mapping[str, Any]) -> None:
        names = [str(name) for name in given.get("names", ())]
        self._service.watch(str(given["env"]), str(given["item"]), names, on=bool(given.get("on", True)))

    def _add_logger(self, given: Mapping[str, Any]) -> None:
        self._service.add_logger(
            str(given["env"]),
            str(given["logger"]),
            priority=int(given.get("priority", ABOVE)),
            level=str(given.get("level", "debug")),
            contains=str(given.get("contains", "")),
            replaces=bool(given.get("replaces")),
            component=str(given.get("component", "")),
        )


_Part = TypeVar("_Part")


def _there(part: _Part | None) -> _Part:
    """Return a part of the executive.

    :raises ExecutiveError: when it is not there.
    """
    if part is None:
        raise ExecutiveError("the executive is not there now", hint="see 'cxbridge daemon status'")
    return part


def _in_one_line(text: str) -> str:
    """Return the begin of a client's text, for the log: it must not look like lines of others."""
    return one_line(text[:_LOGGED])


def _parse(verb: str, arguments: str) -> Mapping[str, Any]:
    """Return the arguments of a request.

    :raises CxbridgeError: when they are no JSON object.
    """
    try:
        given = json.loads(arguments or "{}")
    except (ValueError, RecursionError) as error:
        raise CxbridgeError(f"the arguments of {verb} are no JSON: {error}") from None
    if not isinstance(given, dict):
        raise CxbridgeError(f"the arguments of {verb} are no JSON object")
    return given


def _row(item: Breakpoint) -> dict[str, Any]:
    return {"number": item.number, "spec": str(item)}


def _stop_row(stop: Stop | None) -> dict[str, Any] | None:
    return None if stop is None else stop.plain()


def _refusal(error: CxbridgeError) -> dict[str, Any]:
    where = f"{error.location}: " if error.location else ""
    return {"error": where + error.message, "hint": error.hint}
