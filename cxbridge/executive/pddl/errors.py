"""Errors in PDDL texts, with file, line and column."""

from __future__ import annotations

from collections.abc import Callable

from cxbridge.errors import PddlError
from cxbridge.executive.pddl.ast import Position

Warn = Callable[[PddlError], None]
"""Receives mistakes that do not prevent reading."""


class PddlSyntaxError(PddlError):
    """The text is not PDDL, or not in the supported part of PDDL."""


class PddlSemanticError(PddlError):
    """The text is PDDL, but its content is wrong or cannot become facts.

    For example, a name is undeclared, or a type or number of arguments is wrong.
    """


def syntax_error(message: str, position: Position, file: str, hint: str | None = None) -> PddlSyntaxError:
    return PddlSyntaxError(message, file=file or None, line=position.line, column=position.column, hint=hint)


def semantic_error(message: str, position: Position, file: str, hint: str | None = None) -> PddlSemanticError:
    return PddlSemanticError(
        message, file=file or None, line=position.line, column=position.column, hint=hint
    )
