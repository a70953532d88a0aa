"""Endpoints of the API: their description, their errors, and their lookup by path."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from cxbridge.plugins import package_hint
from cxbridge.rights import Right, Rights
from cxbridge_web.host import WebHost
from cxbridge_web.models import Model

if TYPE_CHECKING:
    from cxbridge_web.extensions.state import ServerState


class ApiError(Exception):
    """A request that cannot be fulfilled.

    :param status: the HTTP status.
    :param text: the error text.
    :param model: the body of the reply; None to reply with the text.
    """

    def __init__(self, status: int, text: str, model: Mapping[str, Any] | Model | None = None) -> None:
        super().__init__(text)
        self.status = status
        self.text = text
        self.model = model


@dataclass(frozen=True, slots=True)
class ApiCall:
    """A request to an endpoint.

    :param host: the process that hosts the web server.
    :param server: the objects of the web server.
    :param path_values: the values of the names in the path, by name.
    :param query: the value of each query parameter; of a repeated parameter, the last.
    :param body: the members of the body's JSON object; empty without a body.
    """

    host: WebHost
    server: ServerState
    path_values: Mapping[str, str]
    query: Mapping[str, str]
    body: Mapping[str, Any] = field(default_factory=dict)

    def text(self, name: str) -> str:
        """Return a member of the body that must be a text.

        :raises ApiError: if the member is missing, empty or not a text.
        """
        value = self.body.get(name)
        if not isinstance(value, str) or not value:
            raise ApiError(400, f"The body lacks '{name}', which must be a text")
        return value


# Returns the reply (a JSON value, models or `TextReply`), or the value that `finish` converts to the reply,
# or a generator that the main loop runs in pieces, and that returns one of these. Raises `ApiError`.
Handler = Callable[[ApiCall], Any]


class TextReply(str):
    """A plain text reply instead of JSON."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class QueryParameter:
    """A query parameter."""

    name: str
    description: str
    type: Any = str


def matches(name: str, pattern: str) -> bool:
    """Return whether a name matches a shell pattern; an empty pattern matches all names."""
    return not pattern or fnmatchcase(name, pattern)


@dataclass(frozen=True, slots=True, kw_only=True)
class Endpoint:
    """A method of a path.

    :param path: relative to ``/api``; ``{x}`` matches one segment, ``{x+}`` one or more characters with
        slashes; ``/?`` at the end makes the slash optional.
    :param summary: one sentence about the endpoint, for the OpenAPI document.
    :param reply: the type of the answer, a model or a list of models; a text by default.
    :param path_types: the types of values in the path by name; a name without a type stands for a text.
    :param body: the type of the body, a struct; None without a body.
    :param errors: possible errors by status.
    :param right: the required right; by default `LOOK` for GET and `PROGRAMS` for other methods.
    :param runs_in_thread: whether the handler waits, and so runs in a thread instead of the main loop.
    :param is_skill: whether the endpoint runs a skill string, which counts as a program if it is evaluated as
        Lua.
    :param stalled_handler: replaces the handler while the main loop is stuck, and runs in a thread.
    :param timeout_s: the time limit for the main loop to carry out a request.
    :param finish: converts the handler's return value to the reply, in a further thread.
    """

    method: str
    path: str
    handler: Handler
    summary: str
    reply: Any = str
    path_types: Mapping[str, Any] = field(default_factory=dict)
    query: tuple[QueryParameter, ...] = ()
    body: type[Struct] | None = None
    errors: Mapping[int, str] = field(default_factory=dict)
    right: Right | None = None
    is_skill: bool = False
    runs_in_thread: bool = False
    stalled_handler: Handler | None = None
    timeout_s: float = 10.0
    finish: Callable[[ApiCall, Any], Any] = lambda _call, content: content

    @property
    def component(self) -> str:
        """The first segment of the path."""
        return self.path.split("/")[1]

    def needed_right(self, rights: Rights) -> Right:
        """Return the right that clients of a daemon need."""
        if self.is_skill and rights.skills_are_programs:
            return Right.PROGRAMS
        if self.right is not None:
            return self.right
        return Right.LOOK if self.method == "GET" else Right.PROGRAMS


# A name in a path that `re.escape` has escaped: `\{id\}` or `\{id\+\}`.
_PATH_NAME = re.compile(r"\\{([a-z_\\-]+)(\\\+)?\\}")


def _compile_path(path: str) -> re.Pattern[str]:
    """Return the regular expression of a path, whose groups have underscores for the dashes of names."""

    def make_group(match: re.Match[str]) -> str:
        name = match[1].replace("\\", "").replace("-", "_")
        return f"(?P<{name}>{'.+?' if match[2] else '[^/]+'})"

    # DOTALL: an id in a path may contain an encoded line feed
    path_without_slash = path.removesuffix("/?")
    optional_slash = "" if path_without_slash == path else "/?"
    return re.compile(_PATH_NAME.sub(make_group, re.escape(path_without_slash)) + optional_slash, re.DOTALL)


class EndpointTable:
    """All endpoints; the first match wins."""

    def __init__(self, endpoints: Sequence[Endpoint]) -> None:
        self.endpoints: Final = tuple(endpoints)
        self._patterns = [(_compile_path(endpoint.path), endpoint) for endpoint in endpoints]
        self._components = {endpoint.component for endpoint in endpoints}

    def find(self, method: str, path: str) -> tuple[Endpoint, dict[str, str]]:
        """Return the endpoint of a path below ``/api`` and the values of its names.

        :raises ApiError: if no endpoint matches.
        """
        for pattern, endpoint in self._patterns:
            if endpoint.method == method and (match := pattern.fullmatch(path)):
                return endpoint, match.groupdict()
        # The errors have the texts of Fawkes' webview.
        component, slash, subpath = path.removeprefix("/").partition("/")
        if not component:
            raise ApiError(404, "REST API overview not yet implemented\n")
        if component not in self._components:
            raise ApiError(404, f"REST API '{component}' unknown\n")
        package_hint_text = self._describe_absent_package(path)
        raise ApiError(404, f"REST API '{component}' has no endpoint '{slash}{subpath}'{package_hint_text}\n")

    def _describe_absent_package(self, path: str) -> str:
        """Return a colon and the hint to the missing package that serves a path; empty if none is missing."""
        path_prefix = "/".join(path.split("/")[:3])  # the first two segments, below which one package serves
        hint = package_hint(f"/api{path_prefix}")
        is_installed = any(endpoint.path.startswith(path_prefix) for endpoint in self.endpoints)
        return f": {hint}" if hint and not is_installed else ""
