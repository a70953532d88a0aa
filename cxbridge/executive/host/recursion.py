"""A bound for functions that call themselves: CLIPS evaluates by recursion in C, and knows no bound.

Without one, ``(deffunction f () (f))`` ends the whole process as soon as the stack is used up. So the host
puts ``(cx-guard-recursion NAME)`` at the beginning of every function of users' files that may come back to
itself: one that names itself, one that existed before (mutual recursion needs that in CLIPS), one that
calls a function that only the run can tell (``funcall``, ``eval``, ``send``), and every message handler. So
has a ``default-dynamic`` with such a call: it may make another fact of its kind. The guard looks at how much
of the thread's stack is left.
"""

from __future__ import annotations

import ctypes
import re
import threading
from collections.abc import Callable, Iterator

from clips._clips import ffi, lib

from cxbridge.clipstext.syntax import PARENTHESIS
from cxbridge.executive.host.capi import CData, callback

GUARD_FUNCTION = "cx-guard-recursion"
"""The host's function that recursive functions begin with."""

# Bytes of the stack that are left alone: for the calls of a function on its last level.
_RESERVE = 2 * 1024 * 1024

# Bytes of the stack that CLIPS may use, however large it is.
_MOST = 256 * 1024 * 1024

_FUNCTION = re.compile(r"\(\s*(?:deffunction|defmethod)\s+([^\s()]+)(?:\s+\d+)?\s*")
_HANDLER = re.compile(
    r"\(\s*defmessage-handler\s+[^\s()]+\s+([^\s()]+)(?:\s+(?:around|before|primary|after)(?=[\s(]))?\s*"
)
# Functions of CLIPS that call functions whose names only the run can tell.
_INDIRECT = (
    *("funcall", "sort", "call-specific-method"),
    *("eval", "build", "assert-string", "str-assert", "load-facts"),
    *("send", "make-instance", "initialize-instance", "load-instances", "restore-instances"),
)

_INDIRECT_CALL = re.compile(rf"\(\s*(?:{'|'.join(map(re.escape, _INDIRECT))})(?=[\s()])")

_SLOTS = re.compile(r"\(\s*(?:deftemplate|defclass)\s+([^\s()]+)")
_DYNAMIC = re.compile(r"\(\s*default-dynamic(?=[\s(])")

# Parentheses around the query of a method's parameter: ``((?x INTEGER (> ?x 3)))``.
_QUERY_DEPTH = 3


def guards_at(code: str, start: int, end: int, is_known: Callable[[str], bool]) -> Iterator[tuple[int, str]]:
    """Yield the places where a construct needs guards, and the texts to insert there.

    The body of a function has a guard, and so has each query of a method: CLIPS evaluates queries first.

    :param code: the text without its strings and comments (:func:`~cxbridge.clipstext.syntax.blank`): an
        example in a documentation string is not a call.
    :param start: where the construct's parenthesis opens in ``code``.
    :param end: behind the one that closes it.
    :param is_known: whether there is a function of this name already.
    """
    handler = _HANDLER.match(code, start, end)
    head = handler or _FUNCTION.match(code, start, end)
    slots = None if head else _SLOTS.match(code, start, end)
    if slots is not None:
        yield from _default_guards(code, slots, end)
    if head is None or not code.startswith("(", head.end()):
        return
    name = head[1]
    calls = re.compile(rf"\(\s*(?:{'|'.join(map(re.escape, (name, *_INDIRECT)))})(?=[\s()])")
    if handler is None and not calls.search(code, head.end(), end) and not is_known(name):
        return
    guard = f"({GUARD_FUNCTION} {name})"
    depth = 0
    for match in PARENTHESIS.finditer(code, head.end(), end):
        if match.group() == "(":
            depth += 1
            if depth == _QUERY_DEPTH:
                yield match.start(), f"(progn {guard} "
            continue
        if depth == _QUERY_DEPTH:
            yield match.end(), ")"
        depth -= 1
        if depth == 0:
            yield match.end(), f" {guard}"
            return


def _default_guards(code: str, slots: re.Match[str], end: int) -> Iterator[tuple[int, str]]:
    """Yield the guards of values that are computed for each new fact or instance."""
    for default in _DYNAMIC.finditer(code, slots.end(), end):
        depth, opened = 0, 0
        for match in PARENTHESIS.finditer(code, default.end(), end):
            if match.group() == "(":
                opened = opened if depth else match.start()
                depth += 1
                continue
            depth -= 1
            if depth < 0:
                break
            if depth == 0 and _INDIRECT_CALL.search(code, opened, match.end()):
                yield opened, f"(progn ({GUARD_FUNCTION} {slots[1]}) "
                yield match.end(), ")"


class _Stacks(threading.local):
    """The address down to which this thread's stack may be used."""

    floor = 0


_stacks = _Stacks()


def _stack_floor() -> int:
    """Return the lowest address of this thread's stack that CLIPS may use; 0 when unknown."""
    library = ctypes.CDLL(None)
    attributes = ctypes.create_string_buffer(256)
    low, size = ctypes.c_void_p(), ctypes.c_size_t()
    library.pthread_self.restype = ctypes.c_void_p
    try:
        if library.pthread_getattr_np(ctypes.c_void_p(library.pthread_self()), attributes) != 0:
            return 0
    except AttributeError:  # not on this platform
        return 0
    try:
        library.pthread_attr_getstack(attributes, ctypes.byref(low), ctypes.byref(size))
    finally:
        library.pthread_attr_destroy(attributes)
    top = (low.value or 0) + size.value
    return max(top - size.value + min(_RESERVE, size.value // 4), top - _MOST)


def make_guard(failed: Callable[[str], None]) -> CData:
    """Return the guard as a C function for :meth:`UdfTable.define_c`.

    :param failed: called with the name of the function whose recursion was ended.
    """

    def guard(env: CData, context: CData, result: CData) -> None:
        # the context is on the stack: its address says how deep we are
        result.lexemeValue = lib.FalseSymbol(env)
        if _stacks.floor == 0:
            _stacks.floor = _stack_floor() or 1
        if int(ffi.cast("intptr_t", context)) > _stacks.floor:
            return
        name = ffi.new("UDFValue *")
        lib.UDFFirstArgument(context, lib.SYMBOL_BIT, name)
        lib.UDFThrowError(context)
        failed(ffi.string(name.lexemeValue.contents).decode("utf-8", "replace"))

    return callback("void(Environment *, UDFContext *, UDFValue *)", guard)
