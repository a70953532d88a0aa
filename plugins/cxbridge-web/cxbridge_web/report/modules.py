"""Joins modules of the page into one script, so that a report stays one file that runs offline.

The page is made of plain ES modules. A report shows some of the same components, but may load nothing.
Each module becomes a function that returns what it exports; those that it imports come before it. Only the
forms of ``import`` and ``export`` that the page uses are known; others are an error, not a guess.
"""

from __future__ import annotations

import posixpath
import re
from functools import cache
from importlib import resources
from typing import Final

FOLDER: Final = "static/js"
"""Where the modules are, within the package ``cxbridge_web``."""

_IMPORT: Final = re.compile(
    r'^import\s+(?P<names>\{[^}]*\}|\*\s+as\s+\w+)\s+from\s+"(?P<path>[^"]+)";\n', re.MULTILINE
)
_EXPORT: Final = re.compile(
    r"^export\s+(?=(?:const|class|function|async\s+function)\s+(?P<names>\{[^}]*\}|\w+))", re.MULTILINE
)
_LEFT: Final = re.compile(r"^\s*(?:import|export)\b(?!\()", re.MULTILINE)
_COMMENT: Final = re.compile(r"^\s*//[^\n]*\n", re.MULTILINE)


class ModuleFormError(ValueError):
    """A module has a form of ``import`` or ``export`` that is not known here."""


@cache
def bundle(entry: str) -> str:
    """Return a module of the page, and those that it imports, as one script.

    :param entry: its path below :data:`FOLDER`.
    :raises ModuleFormError: when one of them cannot be joined.
    """
    exports: dict[str, list[str]] = {}
    parts: list[str] = []
    _add(entry, exports, parts, ())
    script = '(() => {\n"use strict";\n' + "\n".join(parts) + "\n})();\n"
    if "</" in script:
        raise ModuleFormError(f"{entry}: a script within a page cannot contain '</'")
    return script


def _read(path: str) -> str:
    """Return the text of a module."""
    return resources.files("cxbridge_web").joinpath(FOLDER, path).read_text(encoding="utf-8")


def _add(path: str, exports: dict[str, list[str]], parts: list[str], above: tuple[str, ...]) -> None:
    """Add a module after those that it imports.

    :param exports: what the modules that were added export, by their paths, in order.
    :param above: the modules that led to it.
    """
    if path in above:
        raise ModuleFormError(f"{path}: imports itself, by {' and '.join(above[above.index(path) + 1 :])}")
    text = _COMMENT.sub("", _read(path))
    lines = []
    for found in _IMPORT.finditer(text):
        other = posixpath.normpath(posixpath.join(posixpath.dirname(path), found["path"]))
        if other not in exports:
            _add(other, exports, parts, (*above, path))
        names = re.sub(r"^\*\s+as\s+", "", found["names"])
        wanted = re.findall(r"(\w+)(?:\s+as\s+\w+)?", names) if names.startswith("{") else []
        for name in set(wanted) - set(exports[other]):
            raise ModuleFormError(f"{path}: {other} exports no {name}, or not in a declaration of its own")
        lines.append(f"const {names.replace(' as ', ': ')} = module{list(exports).index(other)};\n")
    body, exports[path] = _exports(path, _IMPORT.sub("", text))
    parts.append(
        f"// {path}\nconst module{len(exports) - 1} = (() => {{\n{''.join(lines)}{body}"
        f"return {{ {', '.join(exports[path])} }};\n}})();"
    )


def _exports(path: str, text: str) -> tuple[str, list[str]]:
    """Return a module's text without ``export``, and the names that it exports."""
    names = []
    for found in _EXPORT.finditer(text):
        names += re.findall(r"(?:\w+\s*:\s*)?(\w+)", found["names"])
    body = _EXPORT.sub("", text)
    left = _LEFT.search(body)
    if left is not None:
        line = body[left.start() :].lstrip().partition("\n")[0]
        raise ModuleFormError(f"{path}: cannot be joined with others: {line}")
    return body, names
