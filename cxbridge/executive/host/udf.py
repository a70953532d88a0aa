"""Python functions in CLIPS (user-defined functions, UDFs).

A UDF gets its arguments as Python values (:mod:`cxbridge.executive.host.values`) with multifields intact.
CLIPS checks the number of arguments, and the types of literal arguments while it parses a construct. It does
not check the types of computed arguments. If a call fails, its error names the first argument of a wrong
type.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from clips._clips import ffi, lib

from cxbridge.errors import ClipsError
from cxbridge.executive.host.capi import MULTIFIELD_TYPE, CData, make_callback
from cxbridge.executive.host.values import (
    TO_PYTHON,
    ExternalAddress,
    FactAddress,
    InstanceAddress,
    InstanceName,
    Symbol,
    Value,
    value_pointer,
)

UNBOUNDED = 65535
"""A ``maximum`` without limit: the constant of the same name in CLIPS."""

_ALL_BITS = (1 << 10) - 1  # accept arguments of any type

# the type letters of the Advanced Programming Guide, with the type in Python and the name in errors
_TYPES: dict[str, tuple[type, str]] = {
    "l": (int, "INTEGER"),
    "d": (float, "FLOAT"),
    "y": (Symbol, "SYMBOL"),
    "s": (str, "STRING"),
    "m": (tuple, "a multifield"),
    "e": (ExternalAddress, "EXTERNAL-ADDRESS"),
    "f": (FactAddress, "FACT-ADDRESS"),
    "n": (InstanceName, "INSTANCE-NAME"),
    "i": (InstanceAddress, "INSTANCE-ADDRESS"),
}

Function = Callable[..., Value]
FailureHandler = Callable[[str, BaseException], None]
"""Gets the function's name and the exception of a failed Python function."""


class UdfTable:
    """The UDFs of one environment.

    :param env: the environment's pointer.
    :param handle_failure: gets the exceptions of Python functions. CLIPS gets an error instead.
    """

    def __init__(self, env: CData, handle_failure: FailureHandler) -> None:
        self._env = env
        self._handle_failure = handle_failure
        # C texts and callbacks by function: CLIPS uses these objects but does not keep them alive
        self._kept_objects: dict[str, tuple[Any, ...]] = {}
        # by name: minimum and maximum number of arguments, and types
        self._signatures: dict[str, tuple[int, int, str]] = {}
        # by name: a list with one item, the present function, which a revocation replaces
        self._function_cells: dict[str, list[Function]] = {}
        self._revoked: set[str] = set()

    @property
    def names(self) -> frozenset[str]:
        """The Python functions that are not revoked."""
        return frozenset(self._signatures.keys() - self._revoked)

    def signature(self, name: str) -> tuple[int, int, str, str]:
        """Return minimum and maximum number of arguments, types and documentation of a function.

        The documentation is the docstring; empty without a docstring.

        :raises KeyError: if the function is unknown.
        """
        function = self._function_cells[name][0]
        # a partial has the docstring of its class
        documented = getattr(function, "func", function)
        return *self._signatures[name], documented.__doc__ or ""

    def revoke(self, names: Iterable[str], reason: str) -> None:
        """Make all calls of these functions fail, until they are defined again.

        :param reason: the text of the error of such calls.
        """

        # CLIPS keeps the names, because rules may use them
        def refuse(*_arguments: Value) -> Value:
            raise ClipsError(reason)

        for name in self.names & frozenset(names):
            self._function_cells[name][0] = refuse
            self._revoked.add(name)

    def define(
        self,
        name: str,
        function: Function,
        minimum: int = 0,
        maximum: int | None = None,
        types: str = "*",
    ) -> None:
        """Make ``function`` callable from CLIPS as ``name``.

        A revoked function that is defined again keeps its number and types of arguments.

        :param minimum: the minimum number of arguments.
        :param maximum: the maximum number of arguments, by default ``minimum``.
        :param types: type letters of the Advanced Programming Guide. ``"*;sy;l"`` means STRING or SYMBOL for
            the first argument, INTEGER for the second, any type for further arguments.
        :raises ValueError: if CLIPS refuses the function, for example because the name is taken.
        """
        maximum = minimum if maximum is None else maximum
        if name in self._revoked:
            self._function_cells[name][0] = function
            self._revoked.discard(name)
            return
        function_cell = [function]
        c_function = make_callback(
            "void(Environment *, UDFContext *, UDFValue *)",
            self._make_entry_point(name, function_cell, minimum, maximum, types),
        )
        self.define_c(name, c_function, minimum, maximum, types)
        self._signatures[name], self._function_cells[name] = (minimum, maximum, types), function_cell

    def define_c(self, name: str, c_function: CData, minimum: int, maximum: int, types: str) -> None:
        """Make a C function callable from CLIPS as ``name``.

        The other parameters are those of :meth:`define`.

        :raises ValueError: if CLIPS refuses the function, for example because the name is taken.
        """
        c_name, c_types = ffi.new("char[]", name.encode()), ffi.new("char[]", types.encode())
        error = lib.AddUDF(
            self._env, c_name, ffi.NULL, minimum, maximum, c_types, c_function, c_name, ffi.NULL
        )
        if error != lib.AUE_NO_ERROR:
            raise ValueError(f"CLIPS refused the function '{name}' (AddUDF error {error})")
        self._kept_objects[name] = (c_name, c_types, c_function)

    def _make_entry_point(
        self, name: str, function_cell: list[Function], minimum: int, maximum: int, types: str
    ) -> Callable[[CData, CData, CData], None]:
        """Return the function that CLIPS calls. CLIPS has checked the number of arguments.

        :param function_cell: a list with the present function, which a revocation replaces.
        """
        # locals, because rules call functions very often and a local is faster than an attribute
        handle_failure, read_first, read_next = (
            self._handle_failure,
            lib.UDFFirstArgument,
            lib.UDFNextArgument,
        )
        has_next, throw, converters = lib.UDFHasNextArgument, lib.UDFThrowError, TO_PYTHON
        void = lib.VoidConstant(self._env)
        # CLIPS reads the first argument by one function, all others by another
        readers, has_optional = (read_first, *[read_next] * (minimum - 1))[:minimum], minimum < maximum
        # shared by all calls: an argument is converted before any other call can begin
        value = ffi.new("UDFValue *")

        def call(env: CData, context: CData, result: CData) -> None:
            arguments: list[Value] = []
            try:
                # the readers accept a value of any type, so that none of them fails
                for read in readers:
                    read(context, _ALL_BITS, value)
                    arguments.append(converters[value.header.type](value))
                while has_optional and has_next(context):
                    (read_next if arguments else read_first)(context, _ALL_BITS, value)
                    arguments.append(converters[value.header.type](value))
                returned = function_cell[0](*arguments)
                if returned is None:
                    result.voidValue = void
                else:
                    store_value(env, returned, result)
            except BaseException as error:  # noqa: BLE001  nothing may unwind through C
                throw(context)
                # CLIPS checks types only while parsing: a wrong type of a computed argument shows up here
                handle_failure(name, find_wrong_argument(types, arguments) or error)

        return call


def find_wrong_argument(types: str, arguments: Sequence[Value]) -> ClipsError | None:
    """Return an error about the first argument of a wrong type; None if all types fit.

    :param types: as in :meth:`UdfTable.define`.
    """
    default, *specific = types.split(";")
    for number, argument in enumerate(arguments, start=1):
        letters = (specific[number - 1] if number <= len(specific) else "") or default
        # letters without a type in Python, such as ``*``, accept any argument
        accepted = [_TYPES[letter] for letter in letters if letter in _TYPES]
        if len(accepted) == len(letters) and type(argument) not in [kind for kind, _ in accepted]:
            return ClipsError(
                f"argument {number} must be {' or '.join(name for _, name in accepted)}, not {argument!r}"
            )
    return None


def store_value(env: CData, value: Value, result: CData) -> None:
    """Store a Python value in a ``UDFValue *``."""
    result.value = value_pointer(env, value)
    if result.header.type == MULTIFIELD_TYPE:
        result.begin = 0
        result.range = result.multifieldValue.length
