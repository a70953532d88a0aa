"""CLIPS environments for reading a program's constructs without side effects.

CLIPS evaluates parts of constructs while reading them: values of globals, default values, saliences, tests.
Therefore each function is replaced by a stub, which only returns a value of the function's type, unless
:data:`KEPT_FUNCTIONS` has a reason to keep the function. The functions are listed from CLIPS' own table, so
future functions of CLIPS, features and plug-ins become stubs, too.

A stub replaces the pointer of the function in that table, so that constructs that CLIPS has read before also
call the stub. CLIPS still parses calls, and checks the number and types of arguments.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Final

from clips import _clips
from clips._clips import ffi, lib

from cxbridge.events import EventBus
from cxbridge.executive.host.capi import EXTRA_FUNCTIONS, NULL, CData, decode, encode, make_callback
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.loading import Diagnostic
from cxbridge.executive.host.udf import store_value
from cxbridge.executive.host.values import FALSE, InstanceName, Value
from cxbridge.file_access import is_readable_file
from cxbridge_studio.explain.rules.isolated import ALLOWED_FUNCTIONS

_FUNCTIONS_BY_REASON: Final = {
    "reads more of the program, which calls the same stubs": """
        batch batch* build eval funcall load load*""",
    "lists the constructs of the environment itself": """
        get-deffunction-list get-defgeneric-list get-defglobal-list get-defrule-list get-function-list""",
    "gives the environment the functions of a feature, and the deftemplate of an interface": """
        blackboard-open blackboard-open-reading blackboard-open-writing blackboard-preload
        ff-feature-request""",
    "chooses the module in which names are found": "get-current-module set-current-module",
    "a function of cxbridge: tests whether a file can be read": "cx-is-file",
    "functions of cxbridge: parts of the shims for CLIPS 6.30": "cx-seed cx-setgen",
}

# The functions that are not replaced, each with the reason.
KEPT_FUNCTIONS: Final = ALLOWED_FUNCTIONS | {
    name: reason for reason, names in _FUNCTIONS_BY_REASON.items() for name in names.split()
}

# The number of loop iterations and function calls after which all evaluations are aborted as endless: more
# than a hundred times the number that any shipped scenario or Fawkes' agent needs.
MAX_EVALUATION_STEPS: Final = 200_000

ENDLESS: Final = "ENDLESS"  # the code of the diagnostic about an aborted evaluation

# Offsets of fields in CLIPS' struct functionDefinition, in pointer-sized words: clipspy does not declare the
# struct.
_TYPES_OFFSET: Final = 2
_POINTER_OFFSET: Final = 3

_ALL_TYPES: Final = (1 << 10) - 1  # the bits of CLIPS' ten types
# The results of stubs, each after the bit of its type: see _make_stub_function.
_RESULTS_BY_TYPE: Final[tuple[tuple[int, Value], ...]] = (
    (lib.INTEGER_BIT, 0),
    (lib.FLOAT_BIT, 0.0),
    (lib.STRING_BIT, ""),
    (lib.MULTIFIELD_BIT, ()),
    (lib.INSTANCE_NAME_BIT, InstanceName("nil")),
)


class StubbedEnvironment(ClipsEnvironment):
    """An environment where only the functions of :data:`KEPT_FUNCTIONS` have an effect. No rule fires.

    :ivar folders: the folders that ``load`` and ``batch`` search after the working directory.
    :ivar stubs: the stubs, by the bits of their result types; -1 for the stub of ``open``.
    """

    def __init__(self, name: str, bus: EventBus, log_component: str | None = None) -> None:
        self.folders: tuple[Path, ...] = ()
        self.stubs: dict[int, CData] = {}
        self._step_count = 0
        self._is_initialised = False
        super().__init__(name, bus, log_component)
        _check_record_layout(self.c_env)
        for function in self.call("get-function-list"):
            self._replace_by_stub(str(function))
        self._is_initialised = True
        self._step_callback = make_callback("void(Environment *, void *)", self._count_step)
        EXTRA_FUNCTIONS.AddPeriodicFunction(self.c_env, b"cxbridge-look", self._step_callback, 0, NULL)

    def define(
        self,
        name: str,
        function: Callable[..., Value],
        minimum: int = 0,
        maximum: int | None = None,
        types: str = "*",
    ) -> None:
        """Define a Python function; a stub replaces the function unless :data:`KEPT_FUNCTIONS` keeps it."""
        super().define(name, function, minimum, maximum, types)
        # Earlier definitions are replaced at the end of the constructor.
        if self._is_initialised:
            self._replace_by_stub(name)

    def load(self, path: Path | str) -> bool:
        """Load a file; a call within a construct returns False."""
        # CLIPS' parser has one position, and would lose that in the file of the construct.
        return not self.loader.is_parsing and super().load(self._resolve(path))

    def batch(self, path: Path | str) -> bool:
        """Execute the commands of a file; a call within a construct returns False."""
        return not self.loader.is_parsing and super().batch(self._resolve(path))

    def _resolve(self, file: Path | str) -> Path | str:
        """Return the path of the first readable file, or the name if there is none."""
        paths = (str(folder / file) for folder in (Path.cwd(), *self.folders))
        return next(filter(is_readable_file, paths), file)

    def fire(self, limit: int = -1, before: int = 0) -> int:  # noqa: ARG002 - no rule fires
        return 0

    def _replace_by_stub(self, name: str) -> None:
        """Replace a function by a stub unless :data:`KEPT_FUNCTIONS` keeps it."""
        if name in KEPT_FUNCTIONS:
            return
        record = ffi.cast("intptr_t *", EXTRA_FUNCTIONS.FindFunction(self.c_env, encode(name)))
        types = int(ffi.cast("unsigned *", record + _TYPES_OFFSET)[0])
        # One stub serves all functions with the same result types; `open` has its own, with the key -1.
        key = -1 if name == "open" else types
        if key not in self.stubs:
            stub_function = _answer_open if name == "open" else _make_stub_function(types)
            self.stubs[key] = make_callback("void(Environment *, UDFContext *, UDFValue *)", stub_function)
        record[_POINTER_OFFSET] = int(ffi.cast("intptr_t", self.stubs[key]))

    def _count_step(self, _env: CData, _context: CData) -> None:
        """Count a step, and abort evaluations after too many steps."""
        self._step_count += 1
        if self._step_count > MAX_EVALUATION_STEPS:
            self.api.halt()
        if self._step_count == MAX_EVALUATION_STEPS + 1:
            text = (
                "a value, default or salience is computed without an end: later expressions are not evaluated"
            )
            self.loader.report(Diagnostic(self.loader.current_file, None, "", ENDLESS, text))


def _check_record_layout(env: CData) -> None:
    """Check that the layout of CLIPS' function records matches :data:`_POINTER_OFFSET`.

    :raises RuntimeError: if the layout differs, because functions would then run in place of their stubs.
    """
    # The library exports SystemCommand, the C function of `system`: its address shows where the pointer is.
    record = ffi.cast("intptr_t *", EXTRA_FUNCTIONS.FindFunction(env, b"system"))
    address = ctypes.cast(ctypes.CDLL(_clips.__file__).SystemCommand, ctypes.c_void_p).value
    if record[_POINTER_OFFSET] != address:
        raise RuntimeError(
            "the check cannot replace functions: this build of CLIPS lays them out in an unknown way"
        )


def _make_stub_function(types: int) -> Callable[[CData, CData, CData], None]:
    """Return the function of a stub for a function whose result may have these types.

    The stub returns the first of :data:`_RESULTS_BY_TYPE` with one of these types. It returns FALSE if any
    type is valid, or if there is no such result. It returns nothing if ``void`` is the only type.
    """
    typed_results = (
        value for bit, value in _RESULTS_BY_TYPE if types & bit and types & _ALL_TYPES != _ALL_TYPES
    )
    value = next(typed_results, None if types == lib.VOID_BIT else FALSE)

    def store_result(env: CData, _context: CData, result: CData) -> None:
        if value is None:
            result.voidValue = lib.VoidConstant(env)
        else:
            store_value(env, value, result)

    return store_result


def _answer_open(env: CData, context: CData, result: CData) -> None:
    """Return TRUE if ``open`` can open a file for reading; the file is not opened.

    Fawkes' ``path-resolve`` calls ``open`` to test whether a file exists.
    """
    name, mode = ffi.new("UDFValue *"), ffi.new("UDFValue *")
    result.lexemeValue = lib.FalseSymbol(env)
    if not lib.UDFFirstArgument(context, lib.SYMBOL_BIT | lib.STRING_BIT, name):
        return
    path = decode(name.lexemeValue.contents)
    lib.UDFNextArgument(context, _ALL_TYPES, mode)  # the logical name, which is not needed
    if lib.UDFHasNextArgument(context):
        lib.UDFNextArgument(context, lib.STRING_BIT, mode)
        if decode(mode.lexemeValue.contents) not in ("r", "rb"):
            return
    if is_readable_file(path):
        result.lexemeValue = lib.TrueSymbol(env)
