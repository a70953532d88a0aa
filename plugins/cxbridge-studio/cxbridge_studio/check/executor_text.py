"""Reads the skills of an executor, a Python class that executes skills, from its text without executing it.

For a run, :mod:`cxbridge.skiller.board.executor` imports the class. Both modules report the same errors, as
far as the text shows them.
"""

from __future__ import annotations

import ast
import importlib.util
from collections.abc import Iterable, Iterator
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Final

from cxbridge.errors import SkillError
from cxbridge.plugins import is_installed
from cxbridge.skiller.board.executor import CLASS_FORM, split_target
from cxbridge.skiller.board.settings import ExecutorSettings

# The names of the base class of all executors: `cxbridge.Skill` is short for SkillExecutor.
_EXECUTOR_BASES: Final = frozenset({"SkillExecutor", "Skill"})

_EXECUTE_HINT: Final = "write: def execute(self, call)"
_EXECUTE_ARGUMENTS: Final = 2  # `self` and the call


def read_executor_skills(executor: ExecutorSettings) -> tuple[str, ...] | None:
    """Return the skills of an executor without importing a user's file; None if they are computed.

    :raises CxbridgeError: if the class is missing or not an executor, with file and line.
    """
    if not isinstance(executor.target, str) or is_installed(executor.target):
        return executor.skills()
    with executor.locate_errors():
        return parse_skills(executor.target, executor.folder)


def parse_skills(target: str, folder: Path) -> tuple[str, ...] | None:
    """Return the skills of an executor's class; None if they are computed or the text is missing.

    :param target: ``MODULE:CLASS`` or ``FILE.py:CLASS``.
    :param folder: the base of a relative file.
    :raises SkillError: if the class is missing or not an executor, with file and line.
    """
    module_name, name = split_target(target)
    file = folder / module_name if module_name.endswith(".py") else _find_module_file(module_name)
    if file is None:
        return None
    body = _parse_file(file).body
    classes = {
        statement.name: statement
        for statement in _walk_statements(body)
        if isinstance(statement, ast.ClassDef)
    }
    if name not in classes:
        if _may_bind(body, name):
            return None
        names = ", ".join(definition.name for definition in classes.values() if definition.bases)
        raise SkillError(
            f"{module_name} has no executor '{name}'", hint=f"it has: {names or 'no SkillExecutor'}"
        )
    return _find_class_skills(classes[name], classes, file)


def _parse_file(file: Path) -> ast.Module:
    """Return the syntax tree of a Python file.

    :raises SkillError: if the file is missing, unreadable or not Python.
    """
    if not file.is_file():
        raise SkillError("there is no such file", file=file)
    try:
        return ast.parse(file.read_bytes(), str(file))
    except SyntaxError as error:
        raise SkillError(f"it does not load: {error.msg}", file=file, line=error.lineno) from None
    except (OSError, ValueError, RecursionError, MemoryError) as error:
        raise SkillError(f"it does not load: {type(error).__name__}: {error}", file=file) from None


def _find_module_file(name: str) -> Path | None:
    """Return the Python file of a module without importing it; None if it has no file."""
    package, *inner = name.split(".")
    try:
        spec = importlib.util.find_spec(package)
        for depth in range(len(inner)):
            if spec is None:
                break
            submodule = ".".join((package, *inner[: depth + 1]))
            spec = PathFinder.find_spec(submodule, spec.submodule_search_locations or [])
    except (ImportError, ValueError):
        spec = None
    if spec is None:
        raise SkillError(f"there is no Python module '{name}'", hint=CLASS_FORM)
    return Path(spec.origin) if spec.origin is not None and spec.origin.endswith(".py") else None


def _walk_statements(body: Iterable[ast.stmt]) -> Iterator[ast.stmt]:
    """Yield the statements of a module, including those below ``if``, ``try`` and ``with``."""
    for statement in body:
        yield statement
        if not isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield from _walk_statements(
                node for node in ast.iter_child_nodes(statement) if isinstance(node, ast.stmt)
            )
            for handler in getattr(statement, "handlers", ()):
                yield from _walk_statements(handler.body)


def _may_bind(body: Iterable[ast.stmt], name: str) -> bool:
    """Return whether an import or another statement may define a name."""
    for statement in _walk_statements(body):
        if isinstance(statement, ast.Import | ast.ImportFrom):
            if any(alias.asname == name or alias.name in (name, "*") for alias in statement.names):
                return True
        elif isinstance(statement, ast.FunctionDef):
            continue
        elif any(isinstance(node, ast.Name) and node.id == name for node in ast.walk(statement)):
            return True
    return False


def _find_class_skills(
    definition: ast.ClassDef, classes: dict[str, ast.ClassDef], file: Path, subclasses: tuple[str, ...] = ()
) -> tuple[str, ...] | None:
    """Return the skills of a class; None if they are computed or inherited from another file.

    :param subclasses: the names of the classes that led to this base class; empty for the executor's class.
    """
    bases = [ast.unparse(base).rpartition(".")[2] for base in definition.bases]
    is_executor_class = not subclasses
    if is_executor_class and not bases and not definition.keywords:
        raise SkillError(f"{definition.name} is not a SkillExecutor", file=file, line=definition.lineno)
    members = list(_walk_statements(definition.body))
    if is_executor_class:
        _check_execute(definition, members, file, is_direct=set(bases) <= _EXECUTOR_BASES)
    if any(isinstance(member, ast.FunctionDef) and member.name == "skills_with" for member in members):
        return None
    # The last assignment counts, as when Python executes the class.
    for member in reversed(members):
        targets = member.targets if isinstance(member, ast.Assign) else [getattr(member, "target", None)]
        if any(isinstance(target, ast.Name) and target.id == "skills" for target in targets):
            return _parse_literal_names(getattr(member, "value", None))
    for base in bases:
        if base in classes and base not in (*subclasses, definition.name):
            return _find_class_skills(classes[base], classes, file, (*subclasses, definition.name))
    return () if set(bases) <= _EXECUTOR_BASES else None


def _parse_literal_names(value: ast.expr | None) -> tuple[str, ...] | None:
    """Return the texts of a literal tuple or list; None if any element is computed."""
    if not isinstance(value, ast.Tuple | ast.List):
        return None
    texts = [element.value for element in value.elts if isinstance(element, ast.Constant)]
    names = tuple(text for text in texts if isinstance(text, str))
    return names if len(names) == len(value.elts) else None


def _check_execute(definition: ast.ClassDef, members: list[ast.stmt], file: Path, *, is_direct: bool) -> None:
    """Check that a class has a valid ``execute``.

    :param is_direct: whether all bases are base classes of executors, so that no class between can define
        ``execute``.
    """
    execute = next(
        (member for member in members if isinstance(member, ast.FunctionDef) and member.name == "execute"),
        None,
    )
    if execute is None:
        # Another statement may define it, too, such as `execute = other_function`.
        if is_direct and not any("execute" in ast.unparse(member) for member in members):
            hint = f"{_EXECUTE_HINT}: yield 0.5"
            raise SkillError(
                f"{definition.name} has no execute()", file=file, line=definition.lineno, hint=hint
            )
        return
    arguments = execute.args
    max_arguments = len(arguments.posonlyargs) + len(arguments.args)
    min_arguments = max_arguments - len(arguments.defaults)
    has_required_keyword = any(default is None for default in arguments.kw_defaults)
    is_callable = (
        min_arguments <= _EXECUTE_ARGUMENTS
        and (max_arguments >= _EXECUTE_ARGUMENTS or arguments.vararg is not None)
        and not has_required_keyword
    )
    if not is_callable and not execute.decorator_list:
        message = f"{definition.name}.execute() does not take a call"
        raise SkillError(message, file=file, line=execute.lineno, hint=_EXECUTE_HINT)
