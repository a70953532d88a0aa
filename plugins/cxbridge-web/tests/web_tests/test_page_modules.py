"""The page's modules fit together: each imported name is exported. No browser is needed for that."""

from __future__ import annotations

import re

from cxbridge_web.pages import STATIC_FOLDER

JS = STATIC_FOLDER / "js"
MODULES = {path.relative_to(JS).as_posix(): path.read_text(encoding="utf-8") for path in JS.rglob("*.js")}
EXPORT = re.compile(
    r"^export\s+(?:(?:const|let|class|function\*?|async\s+function)\s+(\{[^}]*\}|\w+)|(\{[^}]*\}))",
    re.MULTILINE,
)
IMPORT = re.compile(r'^import\s+(?:(\{[^}]*\})|[^"{]*?)\s*(?:from\s+)?"([^"]+)"', re.MULTILINE)


def exports(path: str) -> set[str]:
    found: set[str] = set()
    for declared, listed in EXPORT.findall(MODULES[path]):
        found |= set(re.findall(r"\w+", declared or listed))
    return found


def missing(path: str) -> list[str]:
    """Return the missing modules that one imports, and the missing names."""
    found = []
    for names, other in IMPORT.findall(MODULES[path]):
        if other.startswith("shared/"):
            continue
        target = other.removeprefix("cx/")
        known = exports(target) if target in MODULES else set()
        wanted = re.findall(r"(\w+)(?:\s+as\s+\w+)?", names)
        found += [f"{name} of {other}" for name in wanted if name not in known]
        if target not in MODULES:
            found.append(other)
    return found


def test_what_a_module_imports_is_there():
    assert MODULES
    assert {path: missing(path) for path in MODULES if missing(path)} == {}
