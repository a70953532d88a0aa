"""The table of docs/api.md: the signature and the purpose of each name that the page documents."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pkgutil import resolve_name
from types import GenericAlias

from tests.support import ROOT

_DOCUMENTED = re.compile(r"^::: ([\w.]+)$", re.MULTILINE)
_MAX_PARAMETERS = 6  # the first parameters of longer signatures are shown


def names() -> list[str]:
    """Return the documented modules, classes and functions, in the order of the page."""
    return _DOCUMENTED.findall((ROOT / "docs/api.md").read_text("utf-8"))


def _parameters(target: object) -> str:
    """Return the parameters of a function or class, with defaults; empty for enumerations."""
    if not callable(target) or inspect.isabstract(target) or hasattr(target, "__members__"):
        return ""
    try:
        signature = inspect.signature(target)
    except ValueError:  # a subclass of str
        return ""
    texts: list[str] = []
    for parameter in signature.parameters.values():
        if parameter.name.startswith("_") or parameter.kind is parameter.VAR_KEYWORD:
            continue
        if parameter.kind is parameter.KEYWORD_ONLY and "*" not in texts:
            texts.append("*")
        is_plain = isinstance(parameter.default, str | int | float | bool | tuple | None)
        default = repr(parameter.default) if is_plain else "..."
        texts.append(parameter.name + (f"={default}" if parameter.default is not parameter.empty else ""))
    shown = texts if len(texts) <= _MAX_PARAMETERS else [*texts[:_MAX_PARAMETERS], "..."]
    return f"({', '.join(shown)})"


def _purpose(target: object) -> str:
    """Return the first paragraph of the docstring in one line; the type of an alias."""
    if isinstance(target, GenericAlias):
        return f"`{target}`"
    paragraph = (inspect.getdoc(target) or "").partition("\n\n")[0]
    text = " ".join(paragraph.split()).replace("``", "`").replace("|", "\\|")
    return re.sub(r":\w+:`~?([\w.]+)`", r"`\1`", text)


def lines() -> Iterator[str]:
    """Yield the lines of the table."""
    yield "| module | name | for |"
    yield "| --- | --- | --- |"
    for path in names():
        target = resolve_name(path)
        module, name = (path, "") if inspect.ismodule(target) else path.rsplit(".", 1)
        signature = f"`{name}{_parameters(target)}`" if name else "all names"
        yield f"| `{module}` | {signature} | {_purpose(target)} |"
