"""Operations: requests that clients may send to a daemon.

An operation has a name, typed parameters, a function and the right that a client needs. Clients send the name
of a verb over RequestInterface. An operation with routes is also a request over HTTP.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

import msgspec

from cxbridge.errors import CxbridgeError, ExecutiveError
from cxbridge.rights import Right, Rights

if TYPE_CHECKING:
    from cxbridge.executive.executive import Executive

# The name of the parameter in msgspec's messages: of a wrong value, and of a missing one.
_PARAMETER: Final = re.compile(r"\$\.(?P<wrong>\w+)|field `(?P<missing>\w+)`")


class UnavailableError(ExecutiveError):
    """There is no running executive."""


class NotFoundError(CxbridgeError):
    """A name in a request is unknown.

    :param status: the status over HTTP.
    """

    def __init__(self, text: str, status: int = 404) -> None:
        super().__init__(text)
        self.status = status


class ParameterError(CxbridgeError):
    """A parameter is missing or empty, or its value has another type.

    :param name: the parameter; empty if it is unknown.
    """

    def __init__(self, name: str, text: str) -> None:
        super().__init__(text)
        self.name = name


@dataclass(frozen=True, slots=True)
class OperationContext:
    """The objects that operations work on.

    :param rights: the rights of clients.
    :param find_executive: a function that returns the executive, or None while the executive is not running.
        A daemon without an executive has no such function: None.
    :param component_rows: returns the states of the components for JSON.
    :param change_component: changes the state of a component; gets the names of component and transition.
    :param describe_state: returns goals, plan-actions, skills and the log; gets the parameters of
        :meth:`cxbridge.daemon.requests.StateCollector.describe`.
    """

    rights: Rights
    find_executive: Callable[[], Executive | None] | None  # a function, because a reset makes a new executive
    component_rows: Callable[[], Sequence[Mapping[str, Any]]] = tuple  # without components: an empty tuple
    change_component: Callable[[str, str], None] = lambda _name, _transition: None
    describe_state: Callable[[Mapping[str, Any]], dict[str, Any]] = lambda _parameters: {}

    @property
    def executive(self) -> Executive:
        """The executive.

        :raises UnavailableError: if the executive is not running.
        """
        if self.find_executive is None:
            raise UnavailableError("this daemon has no executive", hint="name a configuration with specs")
        executive = self.find_executive()
        if executive is None:
            raise UnavailableError("the executive is not running now", hint="see 'cxbridge daemon status'")
        return executive


_Parameters = TypeVar("_Parameters", bound=msgspec.Struct)
_Result = TypeVar("_Result")


class NoParameters(msgspec.Struct):
    """The parameters of an operation without parameters."""


_Function = Callable[[OperationContext, _Parameters], _Result]
Handler = Callable[[OperationContext, _Parameters], object]
"""The function of an operation; returns an object that :func:`to_json` can convert."""


@dataclass(frozen=True, slots=True)
class Route(Generic[_Parameters]):
    """A request over HTTP for an operation.

    :param path: below ``/api``; ``{x}`` is a parameter.
    :param summary: a sentence with the purpose of the request, for the description of the API.
    :param reply: the type of the reply: a struct, or a list of structs.
    :param kind: the member ``kind`` of the reply; by default the name of its type.
    :param answer: returns the reply after the operation; by default the reply is the result of the operation.
    :param http_function: the function to call over HTTP instead of the function of the operation.
    :param check: raises an error if a name in the path is unknown; called before the body is parsed.
    :param body: the name of the model of the body, empty without one.
    :param names: the members of the body by parameter, for parameters whose member has another name.
    :param defaults: the defaults of parameters that the client may omit.
    :param query: the parameters of the query, with descriptions.
    :param errors: the descriptions of error replies by status.
    """

    method: str
    path: str
    summary: str
    reply: Any
    kind: str = ""
    answer: Handler[_Parameters] | None = None
    http_function: Handler[_Parameters] | None = None
    check: Callable[[OperationContext, Mapping[str, str]], object] | None = None
    body: str = ""
    names: Mapping[str, str] = field(default_factory=dict)
    defaults: Mapping[str, str] = field(default_factory=dict)
    query: Mapping[str, str] = field(default_factory=dict)
    errors: Mapping[int, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Operation(Generic[_Parameters]):
    """An operation that clients can request.

    :param name: the name, which clients send over RequestInterface if the operation is a verb.
    :param right: the right that clients need.
    :param parameters: the class of the parameters.
    :param carry_out: the function of the operation.
    :param routes: the requests over HTTP.
    :param is_verb: whether RequestInterface offers the operation, as a verb.
    """

    name: str
    right: Right
    parameters: type[_Parameters]
    carry_out: Handler[_Parameters]
    routes: tuple[Route[_Parameters], ...]
    is_verb: bool

    def parse(self, values: Mapping[str, Any], *, strict: bool = False) -> _Parameters:
        """Return the parameters of a request.

        :param values: the values by name.
        :param strict: whether to refuse a text in place of a number.
        :raises ParameterError: if a parameter is missing, or has a value of another type.
        """
        try:
            return msgspec.convert(values, self.parameters, strict=strict)
        except ValueError as error:  # msgspec's ValidationError is one
            match = _PARAMETER.search(str(error))
            if match is not None and match["missing"]:
                raise ParameterError(match["missing"], f"'{match['missing']}' is missing") from None
            raise ParameterError(match["wrong"] if match else "", str(error)) from None


class Operations(list[Operation[Any]]):
    """The operations of a module, which the module assigns to ``OPERATIONS``."""

    def add(
        self,
        name: str,
        right: Right,
        parameters: type[_Parameters],
        *routes: Route[_Parameters],
        is_verb: bool = True,
    ) -> Callable[[_Function[_Parameters, _Result]], _Function[_Parameters, _Result]]:
        """Return a decorator that adds a function as an operation; see :class:`Operation`."""

        def decorate(carry_out: _Function[_Parameters, _Result]) -> _Function[_Parameters, _Result]:
            self.append(Operation(name, right, parameters, carry_out, routes, is_verb))
            return carry_out

        return decorate


def to_json(result: object) -> Any:
    """Return the result of an operation for JSON."""
    return msgspec.to_builtins(result)
