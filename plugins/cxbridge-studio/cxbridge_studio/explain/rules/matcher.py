"""Matches parts of a condition against the facts of a snapshot, in an isolated CLIPS environment.

Each query becomes a rule, the probe: CLIPS itself matches, binds variables and evaluates tests, and each
activation of the probe is a match.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from itertools import islice
from typing import Final

from clips._clips import lib

from cxbridge.clipstext.syntax import definitions
from cxbridge.clipstext.values import FactRef
from cxbridge.clock import VirtualClock
from cxbridge.closing import Closing
from cxbridge.errors import ClipsError
from cxbridge.events import EventBus
from cxbridge.executive.host.capi import NULL, encode
from cxbridge.executive.host.facts.copying import FactRow
from cxbridge.executive.host.source import check_parser_limits
from cxbridge.executive.host.udf import UNBOUNDED
from cxbridge.executive.host.values import FactAddress, Value, clips_value
from cxbridge_studio.debugger.agenda import read_activations
from cxbridge_studio.explain.rules.diagnosis import Count
from cxbridge_studio.explain.rules.isolated import IsolatedEnvironment
from cxbridge_studio.explain.rules.snapshot import Snapshot

MAX_MATCHES: Final = 100_000  # limit of the counted matches: combinations of facts multiply

_PROBE_RULE = "cx-why-probe"
_MISSING_FUNCTION = re.compile(r"Missing function declaration for '([^']+)'")
# A CLIPS error message. The messages DRIVE and PRCCODE4 are left out: they repeat the error's position in
# CLIPS' network.
_MESSAGE = re.compile(r"\[(?!DRIVE|PRCCODE4)[A-Z]+\d+\] [^\n]+")


class Matcher(Closing):
    """An isolated environment with the facts of a snapshot.

    Use as a context manager, which frees the environment.

    A deffunction that calls a function of the run is left out, so conditions that call the deffunction cannot
    be matched.

    :ivar rows: the facts of the snapshot, by their indices there.
    :ivar errors: the errors during matching, each message once.
    """

    def __init__(self, snapshot: Snapshot) -> None:
        bus = EventBus(VirtualClock(snapshot.time_us))
        self._env = IsolatedEnvironment("why", bus)
        self._missing_callees: dict[str, str] = {}  # missing functions by the functions that call them
        self._noted_values: list[tuple[Value, ...]] = []
        # The copied facts have other indices: the snapshot's index by the index of the copy, and the reverse.
        self._original_indices: dict[int, int] = {}
        self._copied_indices: dict[int, int] = {}
        self._globals = {name: self._to_copied_value(value) for name, value in snapshot.globals.items()}
        self.rows: dict[int, FactRow] = {row.index: row for row in snapshot.facts}
        self.errors: list[str] = []
        try:
            self._copy_snapshot(snapshot)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        self._env.destroy()

    def _copy_snapshot(self, snapshot: Snapshot) -> None:
        """Define the snapshot's constructs and assert its facts.

        The order matters: deffunctions may use global variables and templates, facts need their templates.
        """
        env = self._env
        # In `types`, CLIPS' letter f stands for a fact address, and y for a symbol.
        env.define("cx-why-note", self._note_values, 0, UNBOUNDED)
        env.api.remove_udf("fact-index")
        # Conditions compare indices, so they must be those of the snapshot.
        env.define("fact-index", lambda fact: self._to_original_value(fact).index, 1, types="f")
        env.define("cx-why-global", lambda name: self._globals[name], 1, types="y")
        for name in snapshot.globals:
            env.build(f"(defglobal ?*{name}* = (cx-why-global {name}))")
        for name, expression in snapshot.global_texts.items():
            with suppress(ClipsError):  # CLIPS reports the missing variable in each probe that uses it
                env.build(f"(defglobal ?*{name}* = {expression})")
        for template in snapshot.templates.values():
            if template.slots is not None:
                slots = " ".join(
                    f"({'multislot' if is_multislot else 'slot'} {slot})"
                    for slot, is_multislot in template.slots
                )
                env.build(f"(deftemplate {template.name} {slots})")
            elif (fact := env.assert_string(f"({template.name} 0)")) is not None:
                env.retract(fact)  # CLIPS has made the implied deftemplate of ordered facts
        for function in snapshot.functions:
            self._define_function(function)
        for row in snapshot.facts:
            template_slots = snapshot.templates[row.template].slots
            names = [NULL] if template_slots is None else [encode(slot) for slot, _ in template_slots]
            deftemplate = lib.FindDeftemplate(env.c_env, encode(row.template))
            values = [
                (name, clips_value(env.c_env, self._to_copied_value(value)))
                for name, value in zip(names, row.values, strict=True)
            ]
            pointer = env.maker.assert_fact(env.maker.make_fact(deftemplate, values))
            if pointer != NULL:
                index = int(lib.FactIndex(pointer))
                self._original_indices[index] = row.index
                self._copied_indices[row.index] = index

    def _define_function(self, function: str) -> None:
        """Define a deffunction, or record which missing function it calls."""
        try:
            self._env.build(function)
        except ClipsError as error:
            missing_function = _MISSING_FUNCTION.search(error.message)
            callee_name = missing_function[1] if missing_function else ""
            # The missing function may be a deffunction that was left out, too: record the end of the chain.
            for definition in definitions(function):
                self._missing_callees[definition.name] = self._missing_callees.get(callee_name, callee_name)

    def _to_copied_value(self, value: Value) -> Value:
        """Return a value of the snapshot as a value of this environment: facts as addresses, not indices."""
        if isinstance(value, FactRef):
            fact = self._env.maker.find_fact(self._copied_indices.get(value.index, -1))
            return value.index if fact == NULL else FactAddress(fact)
        return tuple(map(self._to_copied_value, value)) if isinstance(value, tuple) else value

    def _to_original_value(self, value: Value) -> Value:
        """Return a value of this environment as a value of the snapshot: facts as indices, 0 if unknown."""
        if isinstance(value, FactAddress):
            return FactRef(self._original_indices.get(int(lib.FactIndex(value.pointer)), 0))
        return tuple(map(self._to_original_value, value)) if isinstance(value, tuple) else value

    def _note_values(self, *values: Value) -> None:
        """Keep the values of a match. The probe calls this function."""
        self._noted_values.append(tuple(map(self._to_original_value, values)))

    def count(self, ces: Sequence[str]) -> Count:
        """Return the number of matches of conditional elements.

        :raises ClipsError: if CLIPS rejects the condition, or a function fails.
        """
        return self._fire_probe(ces, "", MAX_MATCHES)

    def match_values(self, ces: Sequence[str], names: Sequence[str], limit: int) -> list[tuple[Value, ...]]:
        """Return the values of variables for each match of the elements, up to a limit of matches.

        Facts are :class:`FactRef`.

        :param names: the variables without ``?``.
        :raises ClipsError: if CLIPS rejects the condition, a variable is unbound, or a function fails.
        """
        self._noted_values = []
        self._fire_probe(ces, f"(cx-why-note {' '.join(f'?{name}' for name in names)})", limit)
        return self._noted_values

    def match_bases(self, ces: Sequence[str], limit: int) -> list[str]:
        """Return the facts of each match in the agenda's notation, with indices of the snapshot.

        :param limit: the maximum number of matches to return.
        :raises ClipsError: if CLIPS rejects the condition.
        """
        self._build_probe(ces, "")
        bases = [self._restore_indices(basis) for _, _, basis in islice(read_activations(self._env), limit)]
        self._remove_probe()
        return bases

    def _restore_indices(self, basis: str) -> str:
        """Replace the indices of a basis such as ``f-1,*`` by those of the snapshot."""
        return ",".join(
            f"f-{self._original_indices.get(int(item[2:]), 0)}" if item.startswith("f-") else item
            for item in basis.split(",")
        )

    def _build_probe(self, ces: Sequence[str], action: str) -> None:
        """Define the probe with these conditional elements and this action.

        :raises ClipsError: if CLIPS rejects the condition.
        """
        check_parser_limits(" ".join(ces))
        output = self._env.output
        previous_sink = output.begin_error_capture()
        error = lib.Build(self._env.c_env, encode(f"(defrule {_PROBE_RULE} {' '.join(ces)} => {action})"))
        error_output = output.end_error_capture(previous_sink)
        messages = [" ".join(match.split()) for match in _MESSAGE.findall(error_output)]
        if error != lib.BE_NO_ERROR:
            raise ClipsError(self._find_rejection_reason(messages))
        # CLIPS evaluates tests while it matches the facts, so errors of tests come from `Build`.
        self.errors += [message for message in dict.fromkeys(messages) if message not in self.errors]
        self._env.api.clear_halt()  # after an error, CLIPS would end the run at its first rule

    def _find_rejection_reason(self, messages: list[str]) -> str:
        """Return why CLIPS rejects a condition, from its messages."""
        missing_function = _MISSING_FUNCTION.search(" ".join(messages))
        if missing_function is None:
            return messages[0] if messages else "CLIPS rejects the condition"
        name = self._missing_callees.get(missing_function[1]) or missing_function[1]
        is_removed = name in self._env.removed_functions
        return f"it calls '{name}', which {'a diagnosis must not do' if is_removed else 'only the run has'}"

    def _remove_probe(self) -> None:
        lib.Undefrule(lib.FindDefrule(self._env.c_env, encode(_PROBE_RULE)), self._env.c_env)

    def _fire_probe(self, ces: Sequence[str], action: str, limit: int) -> Count:
        """Fire the probe for each match up to a limit, and return the number of matches.

        :raises ClipsError: if CLIPS rejects the condition, or a function fails.
        """
        self._build_probe(ces, action)
        fired_count = self._env.run(limit)
        has_more = self._env.has_activations(1)
        self._remove_probe()
        if self._env.faults:
            raise ClipsError(self._env.faults[0])
        return Count(fired_count, has_more)
