"""Answers of functions that query facts, remembered until such facts change.

An agent counts and searches facts in conditions of rules: CLIPS evaluates them for each new ``time`` fact,
many times a second, though what they query changes seldom. So the host lets a function that queries facts and
has no effects (:mod:`cxbridge.executive.host.functions.pure`) begin with the question whether its answer is
known. It is computed when it is not, and forgotten when a fact of a deftemplate that it reads comes or goes.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final, Protocol

from clips._clips import ffi, lib

from cxbridge.clipstext.syntax import HIDDEN, read
from cxbridge.executive.host.capi import EXTRA, CData, callback, encode
from cxbridge.executive.host.functions.pure import PureFunction, PureFunctions
from cxbridge.executive.host.udf import UNBOUNDED, UdfTable, store
from cxbridge.executive.host.values import FALSE, InstanceName, Symbol, Value, clips_value, to_python

RECALL_FUNCTION: Final = "cx-recall"
"""The host's function that asks for an answer: TRUE when there is one."""

ANSWER_FUNCTION: Final = "cx-answer"
"""The host's function that returns the answer that was asked for last."""

_MOST: Final = 4096
"""Answers of one function that are kept."""

_UNKNOWN: Final = object()
_KEYS: Final = frozenset((int, str, Symbol, InstanceName))
_PLAIN: Final = (float, *_KEYS)
_ALL_BITS: Final = (1 << 10) - 1
_BUILD: Final = re.compile(r"\(\s*build(?=[\s(])")


class FactNews(Protocol):
    """Reports facts that come and go."""

    def on_change(self, template: str, call: Callable[[], None]) -> None:
        """Call ``call`` for each fact of a deftemplate that comes or goes."""


class _Remembered:
    """The answers of one function.

    :ivar known: by the arguments.
    :ivar is_computing: whether an answer is being found: the function goes on then.
    :ivar is_off: whether its answers are not remembered any more.
    """

    def __init__(self, env: CData, function: PureFunction) -> None:
        self.function = function
        self.name = encode(function.name)
        self.known: dict[tuple[object, ...], Value] = {}
        self.is_computing = self.is_off = False
        self.builder = lib.CreateFunctionCallBuilder(env, 4)

    def forget(self) -> None:
        if self.known:
            self.known.clear()


class Answers:
    """The remembered answers of one environment.

    :param env: the environment's pointer.
    :param news: reports facts that come and go.
    """

    def __init__(self, env: CData, udfs: UdfTable, news: FactNews) -> None:
        self._env = env
        self._news = news
        self._functions = PureFunctions()
        self._remembered: dict[str, _Remembered] = {}
        self._by_name: dict[CData, _Remembered] = {}
        self._builders: list[CData] = []
        self._answer: Value = FALSE
        self._argument = ffi.new("UDFValue *")
        self._true, self._false = lib.TrueSymbol(env), lib.FalseSymbol(env)
        self._is_off = False
        signature = "void(Environment *, UDFContext *, UDFValue *)"
        udfs.define_c(RECALL_FUNCTION, callback(signature, self._recall), 1, UNBOUNDED, "*;y")
        udfs.define_c(ANSWER_FUNCTION, callback(signature, self._give), 0, 0, "*")

    # --- while files are loaded ---------------------------------------------------------------------------

    def question_at(self, text: str) -> tuple[int, str] | None:
        """Return where in a function the question for its answer goes, and the question; None: it has none.

        :param text: the whole construct, as it is written.
        """
        node = next(iter(read(text)), None)
        if node is None or self._is_off:
            return None
        if not self._functions.is_same(node):
            self.redefined(node.arguments[0].text)
        function = self._functions.learn(node)
        if function is None or not function.templates:
            return None
        self._remember(function)
        parameters = next(each for each in node.arguments if each.items is not None)
        words = " ".join((function.name, *function.parameters, *sorted(function.variables)))
        question = f" (if ({RECALL_FUNCTION} {words}) then (return ({ANSWER_FUNCTION})))"
        return parameters.end, question

    def look_for_builds(self, text: str) -> None:
        """Remember nothing from now on when a text builds functions while it runs: nobody uses them."""
        if _BUILD.search(text) and any("deffunction" in hidden[0] for hidden in HIDDEN.finditer(text)):
            self._is_off = True
            self.clear()

    def redefined(self, name: str) -> None:
        """Remember no more answers of a function that is another one now, nor of those that call it."""
        for each in self._remembered.values():
            if name == each.function.name or name in each.function.calls:
                each.is_off = True
                each.forget()

    def clear(self) -> None:
        """Forget all functions: there are none any more."""
        for each in self._remembered.values():
            each.is_off = True
            each.forget()
        self._functions = PureFunctions()

    def dispose(self) -> None:
        """Free what is held, so that CLIPS can free its environment."""
        self.clear()
        self._by_name.clear()
        while self._builders:
            lib.FCBDispose(self._builders.pop())

    def _remember(self, function: PureFunction) -> None:
        before = self._remembered.get(function.name)
        if before is not None:
            before.is_off = True
        remembered = _Remembered(self._env, function)
        self._remembered[function.name] = remembered
        symbol = lib.CreateSymbol(self._env, remembered.name)
        EXTRA.RetainLexeme(self._env, symbol)
        self._by_name[symbol] = remembered
        self._builders.append(remembered.builder)
        for template in function.templates:
            self._news.on_change(template, remembered.forget)

    # --- while rules run ----------------------------------------------------------------------------------

    def _recall(self, _env: CData, context: CData, result: CData) -> None:
        """Find the answer for the arguments of a function; FALSE lets the function find it."""
        result.lexemeValue = self._false
        argument = self._argument
        lib.UDFFirstArgument(context, lib.SYMBOL_BIT, argument)
        remembered = self._by_name.get(argument.lexemeValue)
        if remembered is None or remembered.is_off or remembered.is_computing:
            return
        arguments: list[Value] = []
        while lib.UDFHasNextArgument(context):
            if not lib.UDFNextArgument(context, _ALL_BITS, argument):
                return
            arguments.append(to_python(argument))
        key = _key(arguments)
        if key is None:
            return
        try:
            answer = remembered.known.get(key, _UNKNOWN)
            if answer is _UNKNOWN:
                answer = self._compute(remembered, arguments, key)
        except BaseException:  # noqa: BLE001  nothing may unwind through C; the function finds the answer
            remembered.is_off = True
            return
        self._answer = answer
        result.lexemeValue = self._true

    def _compute(self, remembered: _Remembered, arguments: list[Value], key: tuple[object, ...]) -> Value:
        """Let the function find an answer, and keep it if it can be kept."""
        builder, value = remembered.builder, ffi.new("CLIPSValue *")
        lib.FCBReset(builder)
        for each in arguments[: len(remembered.function.parameters)]:  # the rest are globals
            lib.FCBAppend(builder, clips_value(self._env, each))
        remembered.is_computing = True
        try:
            error = lib.FCBCall(builder, remembered.name, value)
        finally:
            remembered.is_computing = False
        if error != lib.FCBE_NO_ERROR or EXTRA.GetHaltExecution(self._env):
            return FALSE  # and all that is under way ends
        answer = to_python(value)
        if not _can_be_kept(answer):
            return answer
        if len(remembered.known) >= _MOST:
            remembered.known.clear()
        remembered.known[key] = answer
        return answer

    def _give(self, env: CData, _context: CData, result: CData) -> None:
        store(env, self._answer, result)


def _key(arguments: list[Value]) -> tuple[object, ...] | None:
    """Return what distinguishes arguments from others; None when answers for them are not to be kept.

    A SYMBOL and a STRING of the same text are equal in Python, so their types count, too. A FLOAT mostly
    comes from a clock: it will not come again.
    """
    flat: list[Value] = []
    for each in arguments:
        flat += (len(each), *each) if isinstance(each, tuple) else (each,)
    kinds = tuple(map(type, flat))
    return (*kinds, *arguments) if _KEYS.issuperset(kinds) else None


def _can_be_kept(value: Value) -> bool:
    """Whether a value is something other than an address: another thing may come to its place."""
    if isinstance(value, tuple):
        return all(map(_can_be_kept, value))
    return isinstance(value, _PLAIN)
