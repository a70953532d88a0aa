"""CLIPS environments for looks: they read the constructs of a program, and nothing of it has an effect.

CLIPS evaluates parts of constructs while it reads them: values of globals, default values, saliences, tests.
So a function is a stub here, which returns a value of the function's type, unless it has a reason in
:data:`LOOKING`: one that a later CLIPS adds is a stub, and so is one of a feature or of a plug-in. Which
functions there are, CLIPS' own table says.

The record of a function in that table points to the stub, so constructs that were read before call it, too.
CLIPS still parses calls of it, and checks the number and the types of their arguments.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Final

from clips import _clips
from clips._clips import ffi, lib

from cxbridge.events import EventBus
from cxbridge.executive.host.capi import EXTRA, NULL, CData, callback, decode, encode
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.facts.existing import EXISTS_FUNCTION
from cxbridge.executive.host.isolated import ALLOWED
from cxbridge.executive.host.loading import Diagnostic
from cxbridge.executive.host.udf import store
from cxbridge.executive.host.values import FALSE, InstanceName, Value
from cxbridge.file_access import is_readable_file

_BY_REASON: Final = {
    "reads more of the program: what is evaluated in it calls the same stubs": """
        batch batch* build eval funcall load load*""",
    "lists the constructs of the environment itself": """
        get-deffunction-list get-defgeneric-list get-defglobal-list get-defrule-list get-function-list""",
    "gives the environment the functions of a feature, and the deftemplate of an interface": """
        blackboard-open blackboard-open-reading blackboard-open-writing blackboard-preload
        ff-feature-request""",
    "chooses the module in which names are found": "get-current-module set-current-module",
    "ours: asks whether a file can be read": "cx-is-file",
    "ours: parts of the shims for CLIPS 6.30": f"{EXISTS_FUNCTION} cx-seed cx-setgen",
}

LOOKING: Final = ALLOWED | {name: reason for reason, names in _BY_REASON.items() for name in names.split()}
"""The functions that work in an environment for looks, and why each may."""

MOST_STEPS: Final = 200_000
"""Rounds of loops, and calls of functions, that an environment evaluates: then an evaluation ends at once."""

ENDLESS: Final = "ENDLESS"
"""The code of an evaluation that was ended."""

# The members of CLIPS' record of a function (struct functionDefinition), in words of a pointer
_TYPES: Final = 2
_POINTER: Final = 3

_ANY: Final = (1 << 10) - 1
# A value of each type, by the type's bit.
_VALUES: Final[tuple[tuple[int, Value], ...]] = (
    (lib.INTEGER_BIT, 0),
    (lib.FLOAT_BIT, 0.0),
    (lib.STRING_BIT, ""),
    (lib.MULTIFIELD_BIT, ()),
    (lib.INSTANCE_NAME_BIT, InstanceName("nil")),
)


class LookEnvironment(ClipsEnvironment):
    """An environment where the functions of :data:`LOOKING` work, the rest are stubs, and no rule fires.

    :ivar folders: where ``load`` and ``batch`` look for files that the working directory does not have.
    """

    def __init__(self, name: str, bus: EventBus, log_component: str | None = None) -> None:
        self.folders: tuple[Path, ...] = ()
        self._stubs: dict[int, CData] = {}
        self._steps = 0
        self._is_made = False
        super().__init__(name, bus, log_component)
        _check_records(self.env)
        for function in self.call("get-function-list"):
            self._stub(str(function))
        self._is_made = True
        self._count = callback("void(Environment *, void *)", self._counted)
        EXTRA.AddPeriodicFunction(self.env, b"cxbridge-look", self._count, 0, NULL)

    @property
    def stubs(self) -> frozenset[int]:
        """The addresses of the C functions that replace functions."""
        return frozenset(int(ffi.cast("intptr_t", stub)) for stub in self._stubs.values())

    def define(
        self,
        name: str,
        function: Callable[..., Value],
        minimum: int = 0,
        maximum: int | None = None,
        types: str = "*",
    ) -> None:
        """Make a Python function known to CLIPS, as a stub unless it is one of those that work."""
        super().define(name, function, minimum, maximum, types)
        if self._is_made:
            self._stub(name)

    def _load(self, file: str) -> Value:
        """Load a file, but not for a value in a construct: CLIPS, which reads that, would lose its place."""
        return FALSE if self.loader.is_parsing else super()._load(self._found(file))

    def _batch(self, file: str) -> Value:
        """Execute a file's commands under the same condition."""
        return FALSE if self.loader.is_parsing else super()._batch(self._found(file))

    def _found(self, file: str) -> str:
        paths = (str(folder / file) for folder in (Path.cwd(), *self.folders))
        return next(filter(is_readable_file, paths), file)

    def fire(self, limit: int = -1, before: int = 0) -> int:  # noqa: ARG002 - no rule fires
        """Fire no rule."""
        return 0

    def _stub(self, name: str) -> None:
        """Make a function a stub, unless it works here."""
        if name in LOOKING:
            return
        record = ffi.cast("intptr_t *", EXTRA.FindFunction(self.env, encode(name)))
        types = int(ffi.cast("unsigned *", record + _TYPES)[0])
        kind = -1 if name == "open" else types
        if kind not in self._stubs:
            answer = _answer_open if name == "open" else _answer_of(types)
            self._stubs[kind] = callback("void(Environment *, UDFContext *, UDFValue *)", answer)
        record[_POINTER] = int(ffi.cast("intptr_t", self._stubs[kind]))

    def _counted(self, _env: CData, _context: CData) -> None:
        """End an evaluation that takes too long: a loop may have no end."""
        self._steps += 1
        if self._steps > MOST_STEPS:
            self.api.halt()
        if self._steps == MOST_STEPS + 1:
            text = "a value, a default or a salience is computed without end: what follows it has none"
            self.loader.report(Diagnostic(self.loader.within, None, "", ENDLESS, text))


def _check_records(env: CData) -> None:
    """See that CLIPS' records of functions are laid out as :data:`_POINTER` says.

    :raises RuntimeError: when they are not, so that no function is taken for a stub that is none.
    """
    record = ffi.cast("intptr_t *", EXTRA.FindFunction(env, b"system"))
    address = ctypes.cast(ctypes.CDLL(_clips.__file__).SystemCommand, ctypes.c_void_p).value
    if record[_POINTER] != address:
        raise RuntimeError("this build of CLIPS lays out functions in an unknown way")


def _answer_of(types: int) -> Callable[[CData, CData, CData], None]:
    """Return a stub that returns a value of one of the types of a function; FALSE where any will do."""
    known = (value for bit, value in _VALUES if types & bit and types & _ANY != _ANY)
    value = next(known, None if types == lib.VOID_BIT else FALSE)

    def answer(env: CData, _context: CData, result: CData) -> None:
        if value is None:
            result.voidValue = lib.VoidConstant(env)
        else:
            store(env, value, result)

    return answer


def _answer_open(env: CData, context: CData, result: CData) -> None:
    """Answer as ``open`` does for reading, and open nothing: Fawkes' ``path-resolve`` asks it for files."""
    name, mode = ffi.new("UDFValue *"), ffi.new("UDFValue *")
    result.lexemeValue = lib.FalseSymbol(env)
    if not lib.UDFFirstArgument(context, lib.SYMBOL_BIT | lib.STRING_BIT, name):
        return
    path = decode(name.lexemeValue.contents)
    lib.UDFNextArgument(context, _ANY, mode)
    if lib.UDFHasNextArgument(context):
        lib.UDFNextArgument(context, lib.STRING_BIT, mode)
        if decode(mode.lexemeValue.contents) not in ("r", "rb"):
            return
    if is_readable_file(path):
        result.lexemeValue = lib.TrueSymbol(env)
