"""Inserts probes into right-hand sides, so that the debugger can stop before each action.

CLIPS cannot stop within a right-hand side, but a function that a right-hand side calls may block. A probe is
such a call, ``(cx-debug-at NUMBER ?x ...)``, before each action of a loaded file, on the same line to keep
the line numbers. CLIPS evaluates the variables only when the function requests them. Recordings do not show
the probes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from clips._clips import ffi, lib

from cxbridge.clipstext.values import Value
from cxbridge.executive.host.capi import CData, make_callback
from cxbridge.executive.host.udf import UNBOUNDED
from cxbridge.executive.host.values import to_python
from cxbridge_studio.dap.rule_lines import RuleAction, find_rules
from cxbridge_studio.explain.rules.environment import detach_value

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_studio.debugger.debugger import Debugger

PROBE_FUNCTION: Final = "cx-debug-at"  # the name of the host function that right-hand sides call

_ANY_TYPE: Final = 0x3FF  # CLIPS' ANY_TYPE_BITS, a macro that cffi does not see


class Probes:
    """The probes in the files of an environment. Create this object before the environment loads files.

    :ivar error: the error during a stop, kept here since an exception cannot pass through CLIPS.
    :ivar values: the variables of the stopped right-hand side; None if no right-hand side is stopped.
    """

    def __init__(self, env: ClipsEnvironment, debugger: Debugger) -> None:
        self.error: BaseException | None = None
        self._debugger = debugger
        # the rule and the action of each probe; a probe has the index of its action as its number
        self._actions: list[tuple[str, RuleAction]] = []
        self.values: Mapping[str, Value] | None = None
        callback = make_callback("void(Environment *, UDFContext *, UDFValue *)", self._handle_probe)
        # CLIPS' notation of the argument types: the first is an integer, the others have any type
        env.udfs.define_c(PROBE_FUNCTION, callback, 1, UNBOUNDED, "*;l")
        env.loader.rewrite = self.rewrite
        self._env = env

    def rewrite(self, _file: str, text: str) -> str:
        """Return the text of a file with probe calls inserted."""
        pieces: list[str] = []
        position = 0
        for rule in find_rules(text):
            for action in rule.actions:
                names = "".join(f" ?{name}" for name in action.names)
                call = f"({PROBE_FUNCTION} {len(self._actions)}{names}) "
                pieces += (text[position : action.start], call)
                position = action.start
                self._actions.append((rule.name, action))
        return "".join((*pieces, text[position:]))

    def _handle_probe(self, env: CData, context: CData, result: CData) -> None:
        """Stop at an action if the debugger requires that. CLIPS calls this method before each action."""
        result.lexemeValue = lib.FalseSymbol(env)  # every function of CLIPS needs a value
        if not self._debugger.watches_lines:
            return
        try:
            self._stop_at_action(context)
        except BaseException as error:  # noqa: BLE001 - raised again after CLIPS has returned
            self.error = error
            self._env.interrupt()

    def _stop_at_action(self, context: CData) -> None:
        # The number is evaluated first, the variables only if the debugger may stop at this action.
        buffer = ffi.new("UDFValue *")
        lib.UDFFirstArgument(context, lib.INTEGER_BIT, buffer)
        rule, action = self._actions[int(buffer.integerValue.contents)]
        if not self._debugger.may_stop_at(rule, action.line):
            return
        try:
            self.values = {name: self._read_next_value(context, buffer) for name in action.names}
            self._debugger.stop_at_line(rule, action.line)
        finally:
            self.values = None

    @staticmethod
    def _read_next_value(context: CData, buffer: CData) -> Value:
        lib.UDFNextArgument(context, _ANY_TYPE, buffer)
        return detach_value(to_python(buffer))
