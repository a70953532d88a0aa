"""A limit for recursive functions. CLIPS evaluates by recursion in C, without a limit.

``(deffunction f () (f))`` would overflow the stack and end the process. Therefore the host inserts
``(cx-guard-recursion NAME)``, the guard, at the start of each function in users' files that may be recursive:
functions that name themselves, functions that existed before (mutual recursion needs that in CLIPS),
functions with indirect calls (``funcall``, ``eval``, ``send``), and message handlers. The guard checks the
remaining stack of the thread.
"""

from __future__ import annotations

import ctypes
import re
import threading
from collections.abc import Callable

from clips._clips import ffi, lib

from cxbridge.clipstext.syntax import top_level_lists
from cxbridge.executive.host.capi import CData, make_callback
from cxbridge.executive.host.retracted import Edit

GUARD_FUNCTION = "cx-guard-recursion"
"""The name of the guard function."""

# the bytes of the stack that remain reserved for calls of a function on its last level
_RESERVED_BYTES = 2 * 1024 * 1024

# the maximum number of stack bytes for CLIPS, chosen freely: the main thread's stack may have no limit
_MAX_STACK_BYTES = 256 * 1024 * 1024

# the start of a construct with a body, up to its parameters; group 1 is the name
_FUNCTION = re.compile(r"\(\s*(?:deffunction|defmethod)\s+([^\s()]+)(?:\s+\d+)?\s*")
_HANDLER = re.compile(
    r"\(\s*defmessage-handler\s+[^\s()]+\s+([^\s()]+)(?:\s+(?:around|before|primary|after)(?=[\s(]))?\s*"
)
# functions that call a function by a name computed at run time
_INDIRECT_FUNCTIONS = (
    *("funcall", "sort", "call-specific-method"),
    *("eval", "build", "assert-string", "str-assert", "load-facts"),
    *("send", "make-instance", "initialize-instance", "load-instances", "restore-instances"),
)
_CALLED_NAME = re.compile(r"\(\s*([^\s()]+)(?=[\s()])")


def find_guard_insertion(code: str, start: int, end: int, is_known: Callable[[str], bool]) -> Edit | None:
    """Return the edit that inserts the guard at the start of a construct's body; None if no guard is needed.

    :param code: the text with strings and comments blanked (:func:`~cxbridge.clipstext.syntax.blank`), so
        that an example in a documentation string does not look like a call.
    :param start: the position of the construct's opening parenthesis.
    :param end: the position after the construct's closing parenthesis.
    :param is_known: returns whether a function exists.
    """
    handler = _HANDLER.match(code, start, end)
    head = handler or _FUNCTION.match(code, start, end)
    if head is None or not code.startswith("(", head.end()):
        return None
    name = head[1]
    called_names = _CALLED_NAME.findall(code, head.end(), end)
    may_call_itself = not {name, *_INDIRECT_FUNCTIONS}.isdisjoint(called_names)
    if handler is None and not may_call_itself and not is_known(name):
        return None
    _, parameters_end = next(top_level_lists(code[head.end() : end]))
    position = head.end() + (parameters_end or 0)
    return position, position, f" ({GUARD_FUNCTION} {name})"


class _ThreadStack(threading.local):
    """The lowest usable stack address of each thread."""

    floor = 0  # not computed yet


_thread_stack = _ThreadStack()


def _find_stack_floor() -> int:
    """Return the lowest stack address that CLIPS may use in this thread; 0 if unknown."""
    library = ctypes.CDLL(None)
    attributes = ctypes.create_string_buffer(256)  # ample: glibc's pthread_attr_t has 56 bytes on x86-64
    lowest_address, size = ctypes.c_void_p(), ctypes.c_size_t()
    library.pthread_self.restype = ctypes.c_void_p
    try:
        if library.pthread_getattr_np(ctypes.c_void_p(library.pthread_self()), attributes) != 0:
            return 0
    except AttributeError:  # missing on this platform
        return 0
    try:
        library.pthread_attr_getstack(attributes, ctypes.byref(lowest_address), ctypes.byref(size))
    finally:
        library.pthread_attr_destroy(attributes)
    # the reserve is at most a quarter of the stack, which may be smaller than the reserve
    top = (lowest_address.value or 0) + size.value
    return max(top - size.value + min(_RESERVED_BYTES, size.value // 4), top - _MAX_STACK_BYTES)


def make_guard(report_recursion: Callable[[str], None]) -> CData:
    """Return the guard as a C function for :meth:`UdfTable.define_c`.

    :param report_recursion: called with the name of an aborted function.
    """

    def guard(env: CData, context: CData, result: CData) -> None:
        # the context lies on the stack, so its address shows the present depth
        result.lexemeValue = lib.FalseSymbol(env)
        if _thread_stack.floor == 0:
            _thread_stack.floor = _find_stack_floor() or 1  # 1: unknown, so that no call is aborted
        if int(ffi.cast("intptr_t", context)) > _thread_stack.floor:
            return
        name = ffi.new("UDFValue *")
        lib.UDFFirstArgument(context, lib.SYMBOL_BIT, name)
        lib.UDFThrowError(context)
        report_recursion(ffi.string(name.lexemeValue.contents).decode("utf-8", "replace"))

    return make_callback("void(Environment *, UDFContext *, UDFValue *)", guard)
