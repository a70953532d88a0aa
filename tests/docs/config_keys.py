"""The configuration keys that the source reads, found in the source.

The first argument of each ``config.get_...(...)`` and the like, with constants put in; what only a run knows
is ``*``.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache

from tests.support import module_files

_READERS = {"get", "exists", "is_list", "keys", "search", "below"}
_CALL = re.compile(r"config\w*\.(?:get|exists|is_list|keys|search|below)")
_LONGEST_CHAIN = 8

Names = Mapping[str, ast.expr]


def keys_that_are_read() -> dict[str, str]:
    """Each key or pattern of keys, with a place where it is read."""
    found = {}
    for module, path in module_files().items():
        if not module.startswith("cxbridge.config.") and _CALL.search(path.read_text()):
            tree = _tree(module)
            source = _Source({**_imports(tree), **_constants(module)})
            for function in ast.walk(tree):
                if isinstance(function, ast.FunctionDef):
                    nodes = list(ast.walk(function))
                    local = dict(_assigned(nodes))
                    for call in nodes:
                        if isinstance(call, ast.Call) and _reads(call):
                            key = source.text(call.args[0], local)
                            if "/" in key:
                                found[key] = f"{module}:{call.lineno}"
    return found


@cache
def _tree(module: str) -> ast.Module:
    """A module's source; empty for modules of dependencies."""
    path = module_files().get(module)
    return ast.parse("" if path is None else path.read_text())


@cache
def _constants(module: str) -> Names:
    return dict(_assigned(_tree(module).body))


def _reads(call: ast.Call) -> bool:
    function = call.func
    return (
        isinstance(function, ast.Attribute)
        and (function.attr in _READERS or function.attr.startswith("get_"))
        and bool(call.args)
        and "config" in ast.unparse(function.value).lower()
    )


def _assigned(nodes: Sequence[ast.AST]) -> Iterator[tuple[str, ast.expr]]:
    """Names that are assigned, with what."""
    for node in nodes:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            yield node.targets[0].id, node.value
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.value:
            yield node.target.id, node.value


def _imports(tree: ast.Module) -> dict[str, ast.expr]:
    """Names that a module imports from our modules, with their values."""
    found: dict[str, ast.expr] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("cxbridge."):
            there = _constants(node.module or "")
            found |= {item.asname or item.name: there[item.name] for item in node.names if item.name in there}
    return found


class _Source:
    """Turns expressions into texts."""

    def __init__(self, known: Names) -> None:
        self._known = known

    def text(self, node: ast.expr, local: Names, depth: int = 0) -> str:  # noqa: PLR0911 - a case each
        deeper = depth + 1
        if depth > _LONGEST_CHAIN:
            return "*"
        match node:
            case ast.Constant(value=str(value)):
                return value
            case ast.JoinedStr(values=parts):
                return "".join(self.text(part, local, deeper) for part in parts)
            case ast.FormattedValue(value=value):
                return self.text(value, local, deeper)
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                return self.text(left, local, deeper) + self.text(right, local, deeper)
            case ast.Name(id=name) if name in local:
                others = {key: value for key, value in local.items() if key != name}
                return self.text(local[name], others, deeper)
            case ast.Name(id=name) if name in self._known:
                return self.text(self._known[name], {}, deeper)
        return "*"


def fixed_lists() -> list[str]:
    """Keys in the lists by which the source refuses unknown keys."""
    from cxbridge.daemon import settings as daemon_settings
    from cxbridge.run import specs
    from cxbridge.skiller.board import settings
    from cxbridge.skiller.simulation import faults

    return [
        *(f"/cxbridge/{name}" for name in daemon_settings.KEYS),
        *(f"/clips-executive/{name}" for name in (*specs._BOOLEAN_KEYS, *specs._LIST_KEYS)),
        *(f"/clips-executive/specs/*/init/*/*/{name}" for name in specs._ENTRY_KEYS),
        *(f"/skill-board/timeouts/{name}" for name in settings._DEFAULT_TIMEOUTS),
        *(f"/plugins/skiller-simulator/failures/*/{name}" for name in faults._ENTRY_KEYS),
    ]
