"""The description of an operation: its parameters, what carries it out, and who may ask for it."""

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
    from cxbridge.executive.host.environment import ClipsEnvironment

_AT: Final = re.compile(r"\$\.(\w+)|field `(\w+)`")


class UnavailableError(ExecutiveError):
    """The executive that an operation needs is not running."""


class NotFoundError(CxbridgeError):
    """A name in a request is unknown.

    :param status: of HTTP.
    """

    def __init__(self, text: str, status: int = 404) -> None:
        super().__init__(text)
        self.status = status


class ParameterError(CxbridgeError):
    """A parameter is missing, or has a value of another type.

    :param name: of the parameter.
    """

    def __init__(self, name: str, text: str) -> None:
        super().__init__(text)
        self.name = name


@dataclass(frozen=True, slots=True)
class OperationContext:
    """What operations work on.

    :param find_executive: returns the executive; None while it is not running. None: there will be none.
    :param component_rows: returns the components of the daemon.
    :param change_component: lets the component of that name take a transition.
    :param describe_state: returns goals, plan-actions, skills and the log.
    """

    rights: Rights
    find_executive: Callable[[], Executive | None] | None
    component_rows: Callable[[], Sequence[Mapping[str, Any]]] = tuple
    change_component: Callable[[str, str], None] = lambda _name, _transition: None
    describe_state: Callable[[Mapping[str, Any]], dict[str, Any]] = lambda _given: {}

    @property
    def executive(self) -> Executive:
        """The executive.

        :raises UnavailableError: when the executive is not running.
        """
        if self.find_executive is None:
            raise UnavailableError("this daemon has no executive", hint="name a configuration with specs")
        found = self.find_executive()
        if found is None:
            raise UnavailableError("the executive is not running now", hint="see 'cxbridge daemon status'")
        return found


_Parameters = TypeVar("_Parameters", bound=msgspec.Struct)
_Result = TypeVar("_Result")


class NoParameters(msgspec.Struct):
    """An operation without parameters."""


class NamedEnvironment(msgspec.Struct):
    """An environment."""

    env: str


def find_environment(context: OperationContext, name: str) -> ClipsEnvironment:
    """Return the environment of a name.

    :raises CxbridgeError: when the executive is not running, or there is no such environment.
    """
    return context.executive.manager.find(name)


def environment_names(context: OperationContext) -> Sequence[str]:
    """Return the names of the environments; none while the executive is not running."""
    try:
        return tuple(context.executive.manager.environments)
    except UnavailableError:
        return ()


_Carrier = Callable[[OperationContext, _Parameters], _Result]
Handler = Callable[[OperationContext, _Parameters], object]
"""Carries an operation out; returns what JSON can have, or dataclasses of it."""


@dataclass(frozen=True, slots=True)
class Route(Generic[_Parameters]):
    """A request over HTTP that asks for an operation.

    :param path: below ``/api``; ``{x}`` is the parameter of that name.
    :param about: one line on its purpose.
    :param reply: the type of the answer: a struct, or a list of one.
    :param kind: the member ``kind`` of the answer; by default the name of its type.
    :param answer: returns the answer afterwards; None: the operation's result.
    :param instead: is called in the operation's place.
    :param check: raises when a name in the path is unknown; called before the body is parsed.
    :param body: name of the model of the body; empty: there is none.
    :param names: parameters that the body calls otherwise: their names there.
    :param given: parameters that the client need not give.
    :param query: parameters that may be in the query, and their meanings.
    :param errors: further results, by status.
    """

    method: str
    path: str
    about: str
    reply: Any
    kind: str = ""
    answer: Handler[_Parameters] | None = None
    instead: Handler[_Parameters] | None = None
    check: Callable[[OperationContext, Mapping[str, str]], object] | None = None
    body: str = ""
    names: Mapping[str, str] = field(default_factory=dict)
    given: Mapping[str, str] = field(default_factory=dict)
    query: Mapping[str, str] = field(default_factory=dict)
    errors: Mapping[int, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Operation(Generic[_Parameters]):
    """Something that clients can ask for.

    :param name: the verb of RequestInterface, and the command at a prompt.
    :param right: what clients need to ask for it.
    :param parameters: their names, types and defaults.
    :param carry_out: does it.
    :param routes: the requests over HTTP that ask for it.
    :param is_verb: RequestInterface takes it.
    :param at_prompt: the prompt of a run's debugger takes it.
    """

    name: str
    right: Right
    parameters: type[_Parameters]
    carry_out: Handler[_Parameters]
    routes: tuple[Route[_Parameters], ...]
    is_verb: bool
    at_prompt: bool

    def parse(self, given: Mapping[str, Any], *, strict: bool = False) -> _Parameters:
        """Return the parameters of a request.

        :param strict: take no text for a number.
        :raises ParameterError: when one is missing, or of another type.
        """
        try:
            return msgspec.convert(given, self.parameters, strict=strict)
        except (msgspec.ValidationError, ValueError) as error:
            found = _AT.search(str(error))
            if found is not None and found[2]:
                raise ParameterError(found[2], f"'{found[2]}' is missing") from None
            raise ParameterError(found[1] if found else "", str(error)) from None

    def words(self, line: str) -> dict[str, str]:
        """Return the parameters that are typed at a prompt: words in their order, the last with all the rest.

        The environment is not typed: a prompt has one.
        """
        names = [name for name in self.parameters.__struct_fields__ if name != "env"]
        return dict(zip(names, line.split(maxsplit=max(len(names) - 1, 0)), strict=False))


class Operations(list[Operation[Any]]):
    """The operations of a module, as ``OPERATIONS``."""

    def add(
        self,
        name: str,
        right: Right,
        parameters: type[_Parameters],
        *routes: Route[_Parameters],
        is_verb: bool = True,
        at_prompt: bool = False,
    ) -> Callable[[_Carrier[_Parameters, _Result]], _Carrier[_Parameters, _Result]]:
        """Add the operation that a function carries out; see :class:`Operation`."""

        def decorate(carry_out: _Carrier[_Parameters, _Result]) -> _Carrier[_Parameters, _Result]:
            self.append(Operation(name, right, parameters, carry_out, routes, is_verb, at_prompt))
            return carry_out

        return decorate


def plain(result: object) -> Any:
    """Return the result of an operation as JSON can have it: the one encoding of results."""
    return msgspec.to_builtins(result)
