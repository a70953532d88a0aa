"""The two ways in which a PDDL text can be wrong."""

from __future__ import annotations

from cxbridge.errors import PddlError
from cxbridge.executive.pddl.ast import Position


class PddlSyntaxError(PddlError):
    """The text is not PDDL, or not the part of PDDL that is understood."""


class PddlSemanticError(PddlError):
    """The text is PDDL with a mistake: an undeclared name, a wrong type or number."""


def syntax_error(message: str, position: Position, file: str, hint: str | None = None) -> PddlSyntaxError:
    """Return a syntax error at a position."""
    return PddlSyntaxError(message, file=file or None, line=position.line, column=position.column, hint=hint)


def semantic_error(message: str, position: Position, file: str, hint: str | None = None) -> PddlSemanticError:
    """Return a semantic error at a position."""
    return PddlSemanticError(
        message, file=file or None, line=position.line, column=position.column, hint=hint
    )
