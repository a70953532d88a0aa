"""The endpoints of the API: their description, the directory that finds them by path, JSON of answers."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated, Any, Final

from msgspec import Meta, Struct

from cxbridge.executive.host.facts.copying import FactCopy
from cxbridge.rights import Right, Rights
from cxbridge_web.host import WebHost
from cxbridge_web.models import Model, plain
from cxbridge_web.paging import MOST_COUNT, Window


class ApiError(Exception):
    """A request that cannot be answered as wished.

    :param status: of HTTP.
    :param text: the mistake, for people.
    :param model: the reply as a model; None: the text is the reply.
    """

    def __init__(self, status: int, text: str, model: Mapping[str, Any] | Model | None = None) -> None:
        super().__init__(text)
        self.status = status
        self.text = text
        self.model = model


class Where(Enum):
    """Who answers."""

    LOOP = "loop"
    """The main loop, between two of its loops."""
    THREAD = "thread"
    """A thread that may wait."""


@dataclass(frozen=True, slots=True)
class ApiCall:
    """A request for an endpoint.

    :param path: the values of the names in the path.
    :param query: the first value of each parameter.
    :param body: the members of the body's JSON object; empty without one.
    :param copied: facts; None: there was nothing to copy.
    """

    host: WebHost
    path: Mapping[str, str]
    query: Mapping[str, str]
    body: Mapping[str, Any] = field(default_factory=dict)
    copied: FactCopy | None = None

    @property
    def facts(self) -> FactCopy:
        """The facts that :attr:`Endpoint.copy` has copied."""
        assert self.copied is not None  # made before the handler is called
        return self.copied

    @property
    def window(self) -> Window:
        """Which part of a list is wanted.

        :raises PagingError: when the query is invalid.
        """
        return Window.of(self.query)

    def text(self, name: str) -> str:
        """Return a member of the body that must be a text.

        :raises ApiError: when it does not exist.
        """
        value = self.body.get(name)
        if not isinstance(value, str) or not value:
            raise ApiError(400, f"The body lacks '{name}', a text")
        return value


Handler = Callable[[ApiCall], Any]
"""Answers: returns what JSON knows, or :class:`Text`; raises :class:`ApiError`."""


class Text(str):
    """A reply that is not a JSON."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Query:
    """A parameter of the query."""

    name: str
    about: str
    type: Any = str


_Count = Annotated[int, Meta(ge=0, le=MOST_COUNT)]

PAGING: Final = (
    Query("limit", "So many at most.", _Count),
    Query("offset", "From that one on; the first is 0.", _Count),
    Query("search", "Those that have this text in any of their texts."),
)
"""The parameters of the query of a paged list; :class:`~cxbridge_web.paging.Window` reads them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Endpoint:
    """A method of a path.

    :param path: below ``/api``; ``{x}`` is one segment, ``{x+}`` one or more characters, slashes included;
        ``/?`` at the end: with or without a slash.
    :param about: one line on its purpose.
    :param reply: the type of its answer, a model or a list of models; a text by default.
    :param names: the types of names in the path that are no texts.
    :param paged: parts of the list can be asked for. What ``finish`` returns is cut, unless it is a
        :class:`~cxbridge_web.paging.Part`.
    :param body: the type of the body, a struct; None: there is none.
    :param errors: what else may result, by status.
    :param right: what clients need; None: for a GET to look, for all else to run programs.
    :param is_skill: it runs a skill string, which is a program when it is evaluated as Lua.
    :param stalled: answers in the handler's place, in the server's thread, while the main loop is stuck.
    :param copy: copies the facts that the handler needs, in pieces, in the main loop. Then the handler is
        called in the server's thread.
    :param finish: makes the reply of the handler's return value, in the server's thread.
    """

    method: str
    path: str
    handler: Handler
    about: str
    reply: Any = str
    names: Mapping[str, Any] = field(default_factory=dict)
    paged: bool = False
    query: tuple[Query, ...] = ()
    body: type[Struct] | None = None
    errors: Mapping[int, str] = field(default_factory=dict)
    right: Right | None = None
    is_skill: bool = False
    where: Where = Where.LOOP
    stalled: Handler | None = None
    copy: Callable[[ApiCall], Generator[None, None, FactCopy]] | None = None
    finish: Callable[[ApiCall, Any], Any] = lambda _call, answer: answer

    @property
    def component(self) -> str:
        """The first segment of the path."""
        return self.path.split("/")[1]

    def needed(self, rights: Rights) -> Right:
        """Return the right that clients of a daemon need for this."""
        if self.is_skill and rights.skills_are_programs:
            return Right.PROGRAMS
        if self.right is not None:
            return self.right
        return Right.LOOK if self.method == "GET" else Right.PROGRAMS


_NAME = re.compile(r"\\{([a-z_\\-]+)(\\\+)?\\}")


def _pattern(path: str) -> re.Pattern[str]:
    """Return the expression of a path; names of groups have no dashes."""

    def group(match: re.Match[str]) -> str:
        name = match[1].replace("\\", "").replace("-", "_")
        return f"(?P<{name}>{'.+?' if match[2] else '[^/]+'})"

    bare = path.removesuffix("/?")
    return re.compile(_NAME.sub(group, re.escape(bare)) + ("" if bare == path else "/?"), re.DOTALL)


class Directory:
    """All endpoints; those before win.

    :param endpoints: in their order.
    """

    def __init__(self, endpoints: Sequence[Endpoint]) -> None:
        self.endpoints: Final = tuple(endpoints)
        self._patterns = [(_pattern(endpoint.path), endpoint) for endpoint in endpoints]
        self._components = {endpoint.component for endpoint in endpoints}

    def find(self, method: str, path: str) -> tuple[Endpoint, dict[str, str]]:
        """Return the endpoint of a path below ``/api``, and the values of its names.

        :raises ApiError: when there is none.
        """
        for pattern, endpoint in self._patterns:
            if endpoint.method == method and (match := pattern.fullmatch(path)):
                return endpoint, match.groupdict()
        _, _, rest = path.partition("/")
        component, slash, more = rest.partition("/")
        if not component:
            raise ApiError(404, "REST API overview not yet implemented\n")
        if component not in self._components:
            raise ApiError(404, f"REST API '{component}' unknown\n")
        raise ApiError(404, f"REST API '{component}' has no endpoint '{slash}{more}'\n")


def to_json(value: Any, *, pretty: bool = False) -> bytes:
    """Return a value as JSON; numbers that JSON lacks are null, bytes that are not UTF-8 a question mark."""
    value = plain(value)
    try:
        text = _dump(value, pretty=pretty)
    except ValueError:
        text = _dump(_finite(value), pretty=pretty)
    return text.encode("utf-8", "replace")


def _dump(value: Any, *, pretty: bool) -> str:
    layout: dict[str, Any] = {"indent": 4} if pretty else {"separators": (",", ":")}
    return json.dumps(value, ensure_ascii=False, allow_nan=False, default=_hex, **layout)


def _hex(value: bytes) -> str:
    """Return the only values that :func:`plain` leaves and json does not know."""
    return bytes(value).hex()


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {name: _finite(item) for name, item in value.items()}
    return [_finite(item) for item in value] if isinstance(value, list) else value
