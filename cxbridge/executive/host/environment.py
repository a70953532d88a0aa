"""A CLIPS environment as in Fawkes: CLIPS 6.4 with the behaviour of 6.30 where agents depend on it.

Shims (:mod:`cxbridge.executive.host.shims`) replace functions that 6.4 removed, changed or added. In users'
files `modify` makes a new fact, as in 6.30; the built-in core relies on 6.4's faster `modify`.
docs/evidence/clips.md lists the differences.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import ClassVar

import clips
from clips._clips import ffi, lib

from cxbridge.clock import split_us
from cxbridge.errors import ClipsError
from cxbridge.events import EventBus, Level, Logger, SourceRead
from cxbridge.executive.host.capi import EXTRA_FUNCTIONS, NULL, CData, ClipsApi, encode, items_of
from cxbridge.executive.host.endless import EndlessRules
from cxbridge.executive.host.facts.constants import DATA_FUNCTION, assert_data
from cxbridge.executive.host.facts.making import FactMaker
from cxbridge.executive.host.facts.modify import Duplicate, Modify
from cxbridge.executive.host.loading import ClipsLoader
from cxbridge.executive.host.output import LineSink, OutputRouter
from cxbridge.executive.host.recursion import GUARD_FUNCTION, make_guard
from cxbridge.executive.host.shims import FUNCTIONS, REMOVED, Clips630Functions, remove_replaced_builtins
from cxbridge.executive.host.source import (
    DUPLICATE_FUNCTION,
    MODIFY_FUNCTION,
    check_parser_limits,
    rewrite_expression,
)
from cxbridge.executive.host.udf import UNBOUNDED, UdfTable
from cxbridge.executive.host.values import Value, clips_value, to_python
from cxbridge.executive.host.watching import Watcher, slot_value, slot_values
from cxbridge.file_access import is_readable_file

CORE_DIR = Path(__file__).resolve().parent.parent / "clips"
"""The folder of the built-in CX core, whose files keep 6.4's `modify`."""

_LEVELS = tuple(Level)  # in ascending order
_CONSTRUCT_NAME = re.compile(r"[^\s()]+")


class ClipsEnvironment:
    """One CLIPS environment.

    Threads must hold :attr:`lock` for each sequence of calls.

    :param name: the unique name, e.g. ``executive``.
    :param log_component: the component of log lines, by default ``CLIPS (NAME)``.
    :ivar faults: messages about faulty Python functions and endless rules. A run with faults has failed.
    :ivar quit_requested: whether the program must end: after ``(quit)`` or ``(exit)``, or a faulty run.
    """

    output_router: ClassVar[type[OutputRouter]] = OutputRouter
    """The class that collects the lines printed by CLIPS."""

    def __init__(self, name: str, bus: EventBus, log_component: str | None = None) -> None:
        self.name, self.bus = name, bus
        self.log: Logger = bus.logger(log_component or f"CLIPS ({name})")
        self.lock = threading.RLock()
        self.faults: list[str] = []
        self.quit_requested = self._is_ended_by_host = self._is_ended_by_halt = False
        self.to_time_fields: Callable[[int], tuple[float | int, ...]] = split_us
        """Converts microseconds since the epoch to the fields of ``(now)`` and of the fact ``time``."""
        self.is_ended = False
        """Whether no rule will fire any more, after ``(exit)`` or an interruption."""
        self.c_env: CData = lib.CreateEnvironment()
        """CLIPS' own environment, an ``Environment *``."""
        self.api = ClipsApi(self.c_env)
        self.maker = FactMaker(self.c_env)
        self.log_level = Level.DEBUG
        """The minimum level of logged lines."""
        self.line_listeners: dict[str, LineSink] = {}
        """Further receivers of all lines, by name."""
        self.output = self.output_router(self.c_env, self._log_line)
        self.watcher = Watcher(self.c_env, self.api, self.output, bus, name)
        self.loader = ClipsLoader(self.c_env, self.output, self.log, self._is_core_file, name)
        self.udfs = UdfTable(self.c_env, self._record_failure)
        self._call_builder = lib.CreateFunctionCallBuilder(self.c_env, 8)  # grows if necessary
        self._is_alive = True
        self.destruction_lock = threading.Lock()
        """Prevents the destruction of the environment while another thread reads it."""
        self.is_firing = False
        """Whether rules are firing, or waiting for a function."""
        self.endless = EndlessRules(
            self.api, self.watcher.activation_basis, self.loader.rule_location, self.log
        )
        self._apply_shims()
        bus.emit_source("environment", name, name, clipspy=clips.__version__, removed=" ".join(REMOVED))

    def _apply_shims(self) -> None:
        remove_replaced_builtins(self.c_env, self.udfs)
        self._clips630_functions = Clips630Functions(self.c_env, self.udfs, self.build_unrecorded)
        self._build_clips630_functions()
        modify_arguments = (self.c_env, self.api, self.maker, self.log.error)
        # name, function, minimum and maximum number of arguments, types, see `UdfTable.define`
        functions: tuple[tuple[str, Callable[..., Value], int, int, str], ...] = (
            ("load", self.load, 1, 1, "*;sy"),
            ("load*", self.load, 1, 1, "*;sy"),  # CLIPS would load without messages
            ("batch", self.batch, 1, 1, "*;sy"),
            ("batch*", self.batch, 1, 1, "*;sy"),
            ("clear", self._clear, 0, 0, "*"),
            ("exit", self._exit, 0, 1, "*"),
            ("halt", self._halt, 0, 0, "*"),
            ("quit", self._quit, 0, 0, "*"),
            ("watch", lambda item, *names: self.watcher.watch(item, names), 1, UNBOUNDED, "y"),
            (
                "unwatch",
                lambda item, *names: self.watcher.watch(item, names, on=False),
                1,
                UNBOUNDED,
                "y",
            ),
            ("cx-unwatch", self.watcher.unwatch_undefined, 2, 2, "y"),
            (MODIFY_FUNCTION, Modify(*modify_arguments), 1, UNBOUNDED, "*"),
            (DUPLICATE_FUNCTION, Duplicate(*modify_arguments), 1, UNBOUNDED, "*"),
            (DATA_FUNCTION, lambda text: assert_data(self.c_env, text), 1, 1, "s"),
            ("cx-is-file", is_readable_file, 1, 1, "*;sy"),
            ("cx-not-found", self.loader.report_missing_file, 1, 1, "*;sy"),
            ("now", lambda: self.to_time_fields(self.bus.clock.now_us()), 0, 0, "*"),
            ("now-systime", lambda: split_us(self.bus.clock.now_us()), 0, 0, "*"),
        )
        for name, function, minimum, maximum, types in functions:
            self.udfs.define(name, function, minimum, maximum, types)
        self.udfs.define_c(GUARD_FUNCTION, make_guard(self._report_recursion), 1, 1, "y")

    def _build_clips630_functions(self) -> None:
        for function in FUNCTIONS:
            self._clips630_functions.build(function)

    @staticmethod
    def _is_core_file(path: Path) -> bool:
        return path.is_relative_to(CORE_DIR)

    def define(
        self,
        name: str,
        function: Callable[..., Value],
        minimum: int = 0,
        maximum: int | None = None,
        types: str = "*",
    ) -> None:
        """Make a Python function callable from CLIPS, see :meth:`UdfTable.define`."""
        self.udfs.define(name, function, minimum, maximum, types)
        if self.bus.wants(SourceRead):
            maximum = minimum if maximum is None else maximum
            self.bus.emit_source(
                "function", self.name, name, minimum=str(minimum), maximum=str(maximum), types=types
            )

    def _log_line(self, level: Level, line: str) -> None:
        """Log a line that CLIPS has printed."""
        for listener in tuple(self.line_listeners.values()):  # clients add listeners in other threads
            listener(level, line)
        if _LEVELS.index(level) >= _LEVELS.index(self.log_level):
            self.log.log(level, line)

    def _record_failure(self, function: str, error: BaseException) -> None:
        """Log an exception of a Python function. CLIPS has received an error instead.

        An exception other than ``ClipsError`` is a fault of the function.
        """
        message = f"function '{function}' failed: {type(error).__name__}: {error}"
        if isinstance(error, ClipsError):
            message = f"{function}: {error}"
        else:
            self.faults.append(message)
        self.log.error(message)

    def _report_recursion(self, function: str) -> None:
        """Report a construct that recursed until the stack was nearly exhausted."""
        # CLIPS would report an error for each level of the recursion; the end of the run resets the router
        self.output.is_quiet = True
        self.log.error(f"'{function}' calls itself endlessly: ended because the stack is exhausted")

    def _clear(self) -> None:
        """Execute ``(clear)``, and restore the host's functions."""
        self.watcher.forget_names()
        lib.Clear(self.c_env)
        self._build_clips630_functions()

    def _exit(self, _code: Value = 0) -> None:
        """End all rules. In Fawkes this ends the process."""
        self.quit_requested = self.is_ended = True
        self.api.halt()

    def _halt(self) -> None:
        """End the run after the active rule."""
        # fire() needs a separate flag, because CLIPS clears its flag before the end of the run
        self._is_ended_by_halt = True
        self.api.request_halt()

    def _quit(self) -> None:
        """Request an orderly end, after pending work and the finalization rules."""
        self.quit_requested = True

    def build(self, construct: str) -> None:
        """Define a construct.

        :raises ClipsError: if CLIPS refuses it.
        """
        self.build_unrecorded(construct)
        if self.bus.wants(SourceRead):
            name = "-".join(_CONSTRUCT_NAME.findall(construct)[:2])  # e.g. defrule-NAME
            self.bus.emit_source(
                "construct", self.name, name, encode(construct), within=self.loader.current_file
            )

    def build_unrecorded(self, construct: str) -> None:
        """Define a construct of the host, which recordings do not contain.

        :raises ClipsError: if CLIPS refuses it.
        """
        outer = self.output.begin_error_capture()
        error = lib.Build(self.c_env, encode(construct))
        messages = self.output.end_error_capture(outer)
        if error != lib.BE_NO_ERROR:
            head = " ".join(construct.split(maxsplit=2)[:2])
            raise ClipsError(f"CLIPS refuses {head}: {' '.join(messages.split())}")

    def has_function(self, name: str) -> bool:
        """Return whether a function exists that is written in C or Python, not in CLIPS."""
        return bool(EXTRA_FUNCTIONS.FindFunction(self.c_env, encode(name)))

    def has_deffunction(self, name: str) -> bool:
        return bool(lib.FindDeffunction(self.c_env, encode(name)) != NULL)

    def eval(self, expression: str) -> Value:
        """Return the value of an expression.

        :raises ClipsError: if the expression does not parse, exceeds a limit of the parser, or fails.
        """
        check_parser_limits(expression)
        value = ffi.new("CLIPSValue *")
        outer = self.output.begin_error_capture()
        error = lib.Eval(self.c_env, encode(rewrite_expression(expression)), value)
        messages = self.output.end_error_capture(outer)
        if error != lib.EE_NO_ERROR:
            self.api.clear_halt()
            raise ClipsError(f"CLIPS cannot evaluate {expression}: {' '.join(messages.split())}")
        return to_python(value)

    def call(self, function: str, *arguments: Value) -> Value:
        """Return the value of a function or deffunction call.

        :raises ClipsError: if the function is unknown or fails.
        """
        lib.FCBReset(self._call_builder)
        for argument in arguments:
            lib.FCBAppend(self._call_builder, clips_value(self.c_env, argument))
        value = ffi.new("CLIPSValue *")
        error = lib.FCBCall(self._call_builder, encode(function), value)
        if error != lib.FCBE_NO_ERROR:
            self.api.clear_halt()
            raise ClipsError(f"calling the CLIPS function '{function}' failed (error {error})")
        return to_python(value)

    def assert_fact(self, template: str, slots: Mapping[str, Value]) -> int | None:
        """Assert a fact. Missing slots get their defaults.

        :returns: the index of the fact, or of an equal fact; None if CLIPS refuses the fact.
        :raises ClipsError: if the deftemplate or a slot is unknown, or a slot cannot hold its value.
        """
        return _fact_index(self.assert_fact_pointer(template, slots))

    def assert_fact_pointer(self, template: str, slots: Mapping[str, Value]) -> CData:
        """Assert a fact like :meth:`assert_fact`; return its ``Fact *``, or NULL if CLIPS refuses it."""
        values = [(encode(slot), clips_value(self.c_env, value)) for slot, value in slots.items()]
        return self._assert_values(template, values)

    def _assert_values(self, template: str, values: list[tuple[bytes, CData]]) -> CData:
        """Assert a fact; return its ``Fact *``, or NULL if CLIPS refuses the fact.

        :param values: see :meth:`FactMaker.make_fact`.
        :raises ClipsError: if the deftemplate or a slot is unknown, or a slot cannot hold its value.
        """
        deftemplate = lib.FindDeftemplate(self.c_env, encode(template))
        if deftemplate == NULL:
            raise ClipsError(f"there is no deftemplate '{template}'")
        try:
            return self.maker.assert_fact(self.maker.make_fact(deftemplate, values))
        except KeyError as error:
            raise ClipsError(f"deftemplate '{template}' does not accept this value in slot {error}") from None

    def assert_ordered(self, relation: str, fields: tuple[Value, ...]) -> int | None:
        """Assert an ordered fact, e.g. ``(time 1 2)``, of a relation that a construct has named.

        :returns: the index of the fact; None if CLIPS refuses it.
        :raises ClipsError: if the relation is unknown, or is a deftemplate with slots.
        """
        return _fact_index(self._assert_values(relation, [(NULL, clips_value(self.c_env, fields))]))

    def assert_string(self, fact: str) -> int | None:
        """Assert a fact written as CLIPS text. Slower than :meth:`assert_fact`.

        :returns: the index of the fact; None if CLIPS refuses it. CLIPS logs an error if the text is wrong.
        """
        return _fact_index(lib.AssertString(self.c_env, encode(fact)))

    def retract(self, index: int) -> bool:
        """Retract a fact by index; return whether the fact existed."""
        fact = self.maker.find_fact(index)
        return bool(fact != NULL and lib.Retract(fact) == lib.RE_NO_ERROR)

    def has_fact(self, index: int) -> bool:
        return bool(self.maker.find_fact(index) != NULL)

    def has_template(self, name: str) -> bool:
        return bool(lib.FindDeftemplate(self.c_env, encode(name)) != NULL)

    def facts(self, template: str | None = None) -> Iterator[tuple[int, str, dict[str, Value]]]:
        """Yield index, deftemplate and slots of all facts, or of one deftemplate's facts."""
        for fact in self._find_facts(template):
            name = ffi.string(lib.DeftemplateName(lib.FactDeftemplate(fact))).decode()
            yield int(lib.FactIndex(fact)), name, slot_values(fact)

    def columns(self, template: str, *slots: str) -> Iterator[tuple[Value, ...]]:
        """Yield the values of some slots for each fact of a deftemplate; none if it or a slot is unknown."""
        names, value = [encode(slot) for slot in slots], ffi.new("CLIPSValue *")
        deftemplate = lib.FindDeftemplate(self.c_env, encode(template))
        # an agent may define a deftemplate of this name with other slots, whose values do not exist
        if deftemplate == NULL or not all(lib.DeftemplateSlotExistP(deftemplate, name) for name in names):
            return
        for fact in items_of(lib.GetNextFactInTemplate, deftemplate):
            yield tuple(slot_value(fact, name, value) for name in names)

    def _find_facts(self, template: str | None) -> Iterator[CData]:
        """Yield all facts, or those of a deftemplate; none if it is unknown."""
        if template is None:
            return items_of(lib.GetNextFact, self.c_env)
        deftemplate = lib.FindDeftemplate(self.c_env, encode(template))
        return iter(()) if deftemplate == NULL else items_of(lib.GetNextFactInTemplate, deftemplate)

    def load(self, path: Path | str) -> bool:
        """Load the constructs of a file; return whether all are valid. :attr:`loader` has the diagnostics."""
        self.watcher.forget_names()
        return self.loader.load(str(path))

    def batch(self, path: Path | str) -> bool:
        """Execute the commands and constructs of a file; return whether CLIPS has read the file."""
        self.watcher.forget_names()
        return self.loader.batch(str(path))

    def emit_settings(self) -> None:
        """Emit the settings of the environment as a source of the run."""
        if self.bus.wants(SourceRead):
            self.bus.emit_source(
                "settings",
                self.name,
                self.name,
                strategy=str(self.eval("(get-strategy)")),
                salience=str(self.eval("(get-salience-evaluation)")),
                duplicates=str(self.eval("(get-fact-duplication)")),
            )

    def refresh_agenda(self) -> None:
        """Evaluate saliences again, as Fawkes does before each run."""
        lib.RefreshAllAgendas(self.c_env)

    def run(self, limit: int = -1) -> int:
        """Run rules until the agenda is empty or ``limit`` rules have fired; return the number of firings.

        A negative ``limit`` means no limit.

        An error ends only its right-hand side, and the agenda continues. Without a limit, endless rules are a
        fault that ends all runs.
        """
        self.watcher.firings = 0
        firing_count = self.fire(limit)
        self.end_run()
        return firing_count

    def fire(self, limit: int = -1, fired_before: int = 0) -> int:
        """Do a part of :meth:`run`. :meth:`end_run` must follow the last part.

        :param fired_before: the number of firings in earlier parts of the run.
        :returns: the number of firings in this part.
        """
        firing_count = 0
        self._is_ended_by_host = self._is_ended_by_halt = False
        if not fired_before:
            self.endless.begin()
        while not self.is_ended:
            chunk_size = (
                self.endless.chunk_size if limit < 0 else min(self.endless.chunk_size, limit - firing_count)
            )
            if chunk_size <= 0:
                break
            # chunks give signal handlers a turn and let endless rules be detected
            self.is_firing = self.output.is_firing = True
            chunk_firing_count = int(lib.Run(self.c_env, chunk_size))
            self.is_firing = self.output.is_firing = False
            firing_count += chunk_firing_count
            if self.api.is_halted():  # an error or the host has ended a right-hand side, and the run with it
                self.api.clear_halt()
                # an error without a firing would occur again and again
                if chunk_firing_count == 0 or self._is_ended_by_host or not self.has_activations(1):
                    break
            elif chunk_firing_count < chunk_size or self._is_ended_by_host or self._is_ended_by_halt:
                break
            # a limited run ends by itself, unless it is a part of a run without limit
            has_limit = limit >= 0 and not fired_before
            if reason := self.endless.check(chunk_firing_count, has_limit=has_limit):
                self.end_faulty_run(reason)
                self.api.clear_halt()  # the interruption must not stop CLIPS' next function
        return firing_count

    def end_run(self) -> None:
        """End a run that was executed in parts."""
        self.endless.end()
        self.output.end_run()

    def end_after_rule(self) -> None:
        """End the active :meth:`fire` after the active rule."""
        self._is_ended_by_host = True
        self.api.request_halt()

    def interrupt(self) -> None:
        """End the active run and prevent further runs. Callable from any thread, even while CLIPS loops."""
        with self.destruction_lock:
            if self._is_alive:
                self.is_ended = True
                self.api.halt()

    def end_faulty_run(self, reason: str) -> None:
        """End the active run as a fault of the agent and prevent further runs. Callable from any thread."""
        self.faults.append(reason)
        self.quit_requested = True
        self.interrupt()

    def abort_rule(self) -> None:
        """End the active right-hand side and the run. Later runs are unaffected.

        Callable from any thread. May be repeated, because a function that the rule calls may clear the
        request.
        """
        with self.destruction_lock:
            if self._is_alive and self.is_firing:
                self.output.is_quiet = True  # each halted match would print a separate error
                self._is_ended_by_host = True
                self.api.halt()

    def has_activations(self, count: int) -> bool:
        """Return whether the agenda has at least ``count`` activations."""
        return len(list(islice(items_of(lib.GetNextActivation, self.c_env), count))) == count

    def destroy(self) -> None:
        """Free the environment."""
        with self.destruction_lock:
            was_alive, self._is_alive = self._is_alive, False
        if was_alive:
            self.output.close()
            self.api.dispose()
            lib.FCBDispose(self._call_builder)
            lib.DestroyEnvironment(self.c_env)


def _fact_index(fact: CData) -> int | None:
    return None if fact == NULL else int(lib.FactIndex(fact))
