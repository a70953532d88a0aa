"""Finds the mistakes that the text of a file shows, while the user types.

``cxbridge check`` also loads the saved files into CLIPS, in another process, which takes seconds. Some of its
findings need only the text of the files. For changed files, the findings of this module, which have the same
codes, replace these.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Final, NamedTuple

from msgspec import Struct

from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent.names import Mention, NameKind, PlacedPiece, SourceFile, Use
from cxbridge_studio.agent.unclosed import describe_unclosed
from cxbridge_studio.check.checks import changes
from cxbridge_studio.check.checks.constructs import (
    UNCLOSED_CONSTRUCT,
    UNKNOWN_FUNCTION,
    UNKNOWN_GLOBAL,
    UNKNOWN_SLOT,
    UNKNOWN_TEMPLATE,
)
from cxbridge_studio.check.checks.domain import DUBIOUS_DOMAIN, WRONG_DOMAIN
from cxbridge_studio.check.findings import UNREADABLE_AGENT, Code
from cxbridge_studio.check.pddl_files import check_pddl_file
from cxbridge_studio.lsp.session import AgentDefinitions, Session

UNKNOWN_NAME_CODES: Final = frozenset(
    {UNKNOWN_TEMPLATE, UNKNOWN_SLOT, UNKNOWN_FUNCTION, UNKNOWN_GLOBAL, changes.UNKNOWN_SLOT}
)
# The names of the codes whose findings need only the text of the files.
TEXT_CODES: Final = frozenset(
    code.name
    for code in (
        *UNKNOWN_NAME_CODES,
        UNREADABLE_AGENT,
        UNCLOSED_CONSTRUCT,
        WRONG_DOMAIN,
        DUBIOUS_DOMAIN,
    )
)

# Uses of the slots of a fact that a variable refers to. Unknown slots have another code there.
_VARIABLE_USES: Final = (Use.CHANGED, Use.QUERIED)
_FACT_USES: Final = (Use.MATCHED, Use.ASSERTED, Use.QUERIED)


class TextFinding(Struct, frozen=True):
    """A mistake between two offsets of a file."""

    code: Code
    start: int
    end: int
    message: str
    hint: str = ""


def find_mistakes(session: Session, file: SourceFile) -> list[TextFinding]:
    """Return the mistakes that the text of a file shows."""
    if file.path.endswith(".clp"):
        return [*_find_unclosed(session, file), *_find_unknown_names(session, file)]
    if file.path.endswith(".pddl"):
        return list(_find_pddl_mistakes(session, file))
    if file.problem is None:
        return []
    offset = file.lines.position(file.problem.line, file.problem.column)
    return [
        TextFinding(
            UNREADABLE_AGENT, offset, _find_word_end(file, offset), file.problem.message, file.problem.hint
        )
    ]


def _find_unclosed(session: Session, file: SourceFile) -> Iterator[TextFinding]:
    slots_by_template = session.find_definitions(file.path).slots | {
        name: set(names) for name, names in session.knowledge.templates.items()
    }
    for placed_piece in file.pieces:
        if not placed_piece.piece.is_closed:
            description = describe_unclosed(
                placed_piece.piece.text, placed_piece.start, file.lines, file.text, slots_by_template
            )
            end = file.text.find("\n", description.start)
            end = placed_piece.end if end < 0 else min(end, placed_piece.end)
            yield TextFinding(
                UNCLOSED_CONSTRUCT, description.start, end, description.message, description.hint
            )


def _find_unknown_names(session: Session, file: SourceFile) -> Iterator[TextFinding]:
    """Yield the undefined names; none before all files are read, since an unread file may define a name."""
    if not session.is_indexed or not session.knowledge.is_complete:
        return
    definitions = session.find_definitions(file.path)
    for placed_piece in file.pieces:
        if not placed_piece.piece.is_closed:
            continue  # the kinds of names depend on the nesting of lists, which an open construct hides
        for index, mention in enumerate(placed_piece.piece.mentions):
            problem, name = None, mention.name.text
            if mention.name.kind is NameKind.SLOT:
                problem = _find_slot_problem(session, definitions, mention)
            elif mention.name.kind is NameKind.FUNCTION and mention.use is Use.CALLED:
                functions = definitions.find_names(NameKind.FUNCTION) | session.knowledge.functions.keys()
                problem = _find_definition_problem(UNKNOWN_FUNCTION, f"function '{name}'", name, functions)
            elif mention.name.kind is NameKind.GLOBAL and mention.use is not Use.DEFINED:
                problem = _find_definition_problem(
                    UNKNOWN_GLOBAL,
                    f"global variable ?*{name}*",
                    name,
                    definitions.find_names(NameKind.GLOBAL),
                )
            elif mention.name.kind is NameKind.TEMPLATE and mention.use in _FACT_USES:
                problem = _find_template_problem(session, definitions, placed_piece, index)
            if problem is not None:
                start, end = placed_piece.start + mention.start, placed_piece.start + mention.end
                yield TextFinding(problem.code, start, end, problem.message, problem.hint)


class _Problem(NamedTuple):
    """The code, message and hint of a finding."""

    code: Code
    message: str
    hint: str


def _find_template_problem(
    session: Session, definitions: AgentDefinitions, placed_piece: PlacedPiece, index: int
) -> _Problem | None:
    """Return the problem of an undefined template; None for a defined template and for ordered facts.

    :param index: the index of the template among the mentions of the piece; its first slot follows, if any.
    """
    mention = placed_piece.piece.mentions[index]
    name = mention.name.text
    if name in definitions.slots or name in session.knowledge.templates or name == "object":
        return None  # a pattern `object` matches instances of classes
    next_mentions = placed_piece.piece.mentions[index + 1 : index + 2]
    slot_mentions = [
        next_mention
        for next_mention in next_mentions
        if next_mention.name.kind is NameKind.SLOT and next_mention.name.owner == name
    ]
    if not slot_mentions or mention.use is Use.QUERIED:
        return None  # an ordered fact needs no deftemplate, and CLIPS accepts any name in a query
    if slot_mentions[0].name.text in session.knowledge.functions.keys() | definitions.find_names(
        NameKind.FUNCTION
    ):
        return None  # a call: (assert (total (+ 1 2))) asserts an ordered fact
    return _Problem(
        UNKNOWN_TEMPLATE, f"there is no deftemplate '{name}'", did_you_mean(name, definitions.slots)
    )


def _find_slot_problem(session: Session, definitions: AgentDefinitions, mention: Mention) -> _Problem | None:
    name, owner = mention.name.text, mention.name.owner
    slots = definitions.slots.get(owner, set()) | set(session.knowledge.templates.get(owner, ()))
    if not slots or name in slots or mention.use is Use.DEFINED:
        return None
    hint = did_you_mean(name, slots) or f"it has: {', '.join(sorted(slots))}"
    code = changes.UNKNOWN_SLOT if mention.use in _VARIABLE_USES else UNKNOWN_SLOT
    return _Problem(code, f"the deftemplate '{owner}' has no slot '{name}'", hint)


def _find_definition_problem(
    code: Code, description: str, name: str, known_names: Collection[str]
) -> _Problem | None:
    """Return the problem of an undefined name; None for a defined name.

    :param description: the kind and the name, for the message.
    """
    if name in known_names:
        return None
    return _Problem(code, f"there is no {description}", did_you_mean(name, known_names))


def _find_pddl_mistakes(session: Session, file: SourceFile) -> Iterator[TextFinding]:
    """Yield the findings of the check for a domain, or for a problem with its domain."""
    reads_as_fawkes = session.knowledge.reads_as_fawkes
    for finding in check_pddl_file(Path(file.path), file.text, fawkes_compat=reads_as_fawkes):
        place, code = finding.place, finding.code
        if Path(place.file) == Path(file.path):  # the findings for a problem include those for its domain
            start = file.lines.position(place.line or 1, place.column or 1)
            yield TextFinding(code, start, _find_word_end(file, start), finding.message, finding.hint)


def _find_word_end(file: SourceFile, start: int) -> int:
    """Return the end of the word at an offset: at least one character later, if the file has one."""
    end = start + 1
    while end < len(file.text) and not file.text[end].isspace() and file.text[end] not in "()":
        end += 1
    return min(end, len(file.text))
