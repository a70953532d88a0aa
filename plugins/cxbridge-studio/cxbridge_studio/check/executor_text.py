"""Reads the skills of an executor, a Python class that executes skills, from its text without executing it.

For a run, :mod:`cxbridge.skiller.board.executor` imports the class, and reports further mistakes in it.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Final

from cxbridge.errors import SkillError
from cxbridge.plugins import is_installed
from cxbridge.skiller.board.executor import split_target
from cxbridge.skiller.board.settings import ExecutorSettings

# The names of the base class of all executors: `cxbridge.Skill` is short for SkillExecutor.
_EXECUTOR_BASES: Final = frozenset({"SkillExecutor", "Skill"})


def read_executor_skills(executor: ExecutorSettings) -> tuple[str, ...] | None:
    """Return the skills of an executor without importing a user's file; None if they are computed.

    :raises CxbridgeError: if the class does not load, or its file cannot be read or lacks the class. The
        error names a file, and the line if it is known.
    """
    if not isinstance(executor.target, str) or is_installed(executor.target):
        return executor.skills()
    with executor.locate_errors():
        return parse_skills(executor.target, executor.folder)


def parse_skills(target: str, folder: Path) -> tuple[str, ...] | None:
    """Return the skills of an executor's class.

    :param target: ``MODULE:CLASS`` or ``FILE.py:CLASS``.
    :param folder: the base of a relative file.
    :returns: None if the skills are computed, or if another file defines the class or its skills.
    :raises SkillError: if the file cannot be read or parsed, or lacks the class.
    """
    file_name, name = split_target(target)
    if not file_name.endswith(".py"):
        return None
    file = folder / file_name
    try:
        text = file.read_text("utf-8", "surrogateescape")
        tree = ast.parse(text, str(file))
    except SyntaxError as error:
        raise SkillError(f"the file does not load: {error.msg}", file=file, line=error.lineno) from None
    # Besides errors of reading: Python's parser raises these for surrogates and deep nesting.
    except (OSError, ValueError, RecursionError, MemoryError) as error:
        raise SkillError(f"the file does not load: {type(error).__name__}: {error}", file=file) from None
    classes = {node.name: node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}
    # The file may also import the class, or make it without a class statement.
    if name not in classes and not re.search(rf"\b{re.escape(name)}\b|import \*", text):
        names = ", ".join(definition.name for definition in classes.values() if definition.bases)
        raise SkillError(
            f"{file_name} has no executor '{name}'", hint=f"it has: {names or 'no SkillExecutor'}"
        )
    return _find_class_skills(name, classes)


def _find_class_skills(name: str, classes: dict[str, ast.ClassDef]) -> tuple[str, ...] | None:
    """Return the skills of a class; None if they are computed or inherited from another file."""
    if name in _EXECUTOR_BASES:
        return ()
    # Each class is removed, so that classes that inherit from each other end the search.
    definition = classes.pop(name, None)
    if definition is None:
        return None
    for member in reversed(definition.body):  # the last assignment counts, as when Python executes the class
        if isinstance(member, ast.FunctionDef) and member.name == "skills_with":
            return None
        # An assignment may have several targets, an annotated assignment has one, other statements have none.
        targets = member.targets if isinstance(member, ast.Assign) else [getattr(member, "target", None)]
        if any(isinstance(target, ast.Name) and target.id == "skills" for target in targets):
            return _parse_literal_names(getattr(member, "value", None))
    bases = [ast.unparse(base).rpartition(".")[2] for base in definition.bases]
    return _find_class_skills(bases[0], classes) if len(bases) == 1 else None


def _parse_literal_names(value: ast.expr | None) -> tuple[str, ...] | None:
    """Return the texts of a literal tuple or list; None for another value or another element."""
    if not isinstance(value, ast.Tuple | ast.List):
        return None
    texts = [element.value for element in value.elts if isinstance(element, ast.Constant)]
    names = tuple(text for text in texts if isinstance(text, str))
    return names if len(names) == len(value.elts) else None
