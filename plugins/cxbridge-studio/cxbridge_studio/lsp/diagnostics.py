"""Diagnostics from the text of a file, updated while typing."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path, PurePath
from typing import Final

from msgspec import Struct

from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent.names import Mention, NameKind, PlacedPiece, SourceFile, Use
from cxbridge_studio.agent.unclosed import describe_unclosed
from cxbridge_studio.check.checks.domain import DOMAIN, DUBIOUS
from cxbridge_studio.check.checks.domain_doubts import EFFECT, OBJECT
from cxbridge_studio.check.findings import Severity
from cxbridge_studio.check.pddl_files import findings_of
from cxbridge_studio.lsp.session import AgentDefinitions, Session

UNREADABLE: Final = "CX101"
UNCLOSED: Final = "CX201"
TEMPLATE: Final = "CX202"
SLOT: Final = "CX203"
FUNCTION: Final = "CX204"
GLOBAL: Final = "CX205"
SLOT_OF_VARIABLE: Final = "CX210"
UNKNOWN_NAMES: Final = frozenset({TEMPLATE, SLOT, FUNCTION, GLOBAL, SLOT_OF_VARIABLE})
# The codes of `cxbridge check` that need only the text of the files.
LIVE: Final = UNKNOWN_NAMES.union(
    {UNREADABLE, UNCLOSED}, (code.name for code in (DOMAIN, DUBIOUS, EFFECT, OBJECT))
)

_OF_VARIABLES: Final = (Use.CHANGED, Use.QUERIED)
_FACT_USES: Final = (Use.MATCHED, Use.ASSERTED, Use.QUERIED)


class LiveFinding(Struct, frozen=True):
    """A mistake between two offsets of its file."""

    code: str
    start: int
    end: int
    message: str
    hint: str = ""
    severity: str = Severity.ERROR.value


def live_findings(session: Session, file: SourceFile) -> list[LiveFinding]:
    """Return the mistakes in a file that are visible without running anything."""
    if file.path.endswith(".clp"):
        return [*_unclosed(session, file), *_unknown_names(session, file)]
    if file.path.endswith(".pddl"):
        return list(_pddl(session, file))
    if file.problem is None or PurePath(file.path).suffix == ".lua":
        return []
    offset = file.lines.place(file.problem.line, file.problem.column)
    return [LiveFinding(UNREADABLE, offset, _word_end(file, offset), file.problem.message, file.problem.hint)]


def _unclosed(session: Session, file: SourceFile) -> Iterator[LiveFinding]:
    slots = session.definitions(file.path).slots | {
        name: set(names) for name, names in session.knowledge.templates.items()
    }
    for placed in file.pieces:
        if not placed.piece.closed:
            description = describe_unclosed(placed.piece.text, placed.start, file.lines, file.text, slots)
            end = file.text.find("\n", description.start)
            end = placed.end if end < 0 else min(end, placed.end)
            yield LiveFinding(UNCLOSED, description.start, end, description.message, description.hint)


def _unknown_names(session: Session, file: SourceFile) -> Iterator[LiveFinding]:
    """Yield undefined names; none before all files are read."""
    if not session.is_indexed or not session.knowledge.is_complete:
        return
    known = session.definitions(file.path)
    for placed in file.pieces:
        if not placed.piece.closed:
            continue  # the nesting of lists is ambiguous
        for number, mention in enumerate(placed.piece.mentions):
            found = None
            if mention.name.kind is NameKind.SLOT:
                found = _slot(session, known, mention)
            elif mention.name.kind is NameKind.FUNCTION and mention.use is Use.CALLED:
                found = _function(session, known, mention)
            elif mention.name.kind is NameKind.GLOBAL and mention.use is not Use.DEFINED:
                found = _global(known, mention)
            elif mention.name.kind is NameKind.TEMPLATE and mention.use in _FACT_USES:
                found = _template(session, known, placed, number)
            if found is not None:
                code, message, hint = found
                start, end = placed.start + mention.start, placed.start + mention.end
                yield LiveFinding(code, start, end, message, hint)


_Problem = tuple[str, str, str]  # code, message and hint


def _template(session: Session, known: AgentDefinitions, placed: PlacedPiece, number: int) -> _Problem | None:
    mention = placed.piece.mentions[number]
    name = mention.name.text
    if name in known.slots or name in session.knowledge.templates or name == "object":
        return None
    after = placed.piece.mentions[number + 1 : number + 2]
    slots = [each for each in after if each.name.kind is NameKind.SLOT and each.name.owner == name]
    if not slots and mention.use is not Use.QUERIED:
        return None  # an ordered fact needs no deftemplate
    functions = session.knowledge.functions.keys() | known.names(NameKind.FUNCTION)
    if mention.use is Use.QUERIED or slots[0].name.text in functions:
        return None  # CLIPS accepts any name in a query; and (assert (total (+ 1 2))) is ordered, too
    return TEMPLATE, f"there is no deftemplate '{name}'", did_you_mean(name, known.slots)


def _slot(session: Session, known: AgentDefinitions, mention: Mention) -> _Problem | None:
    name, owner = mention.name.text, mention.name.owner
    slots = known.slots.get(owner, set()) | set(session.knowledge.templates.get(owner, ()))
    if not slots or name in slots or mention.use is Use.DEFINED:
        return None
    hint = did_you_mean(name, slots) or f"it has: {', '.join(sorted(slots))}"
    code = SLOT_OF_VARIABLE if mention.use in _OF_VARIABLES else SLOT
    return code, f"the deftemplate '{owner}' has no slot '{name}'", hint


def _function(session: Session, known: AgentDefinitions, mention: Mention) -> _Problem | None:
    name = mention.name.text
    functions = known.names(NameKind.FUNCTION) | session.knowledge.functions.keys()
    if name in functions:
        return None
    return FUNCTION, f"there is no function '{name}'", did_you_mean(name, functions)


def _global(known: AgentDefinitions, mention: Mention) -> _Problem | None:
    name = mention.name.text
    known_globals = known.names(NameKind.GLOBAL)
    if name in known_globals:
        return None
    return GLOBAL, f"there is no global variable ?*{name}*", did_you_mean(name, known_globals)


def _pddl(session: Session, file: SourceFile) -> Iterator[LiveFinding]:
    """Yield the findings of the check for a domain, or for a problem with its domain."""
    as_fawkes = session.knowledge.reads_as_fawkes
    for finding in findings_of(Path(file.path), file.text, fawkes_compat=as_fawkes):
        place = finding.place
        if Path(place.file) == Path(file.path):
            offset = file.lines.place(place.line or 1, place.column or 1)
            code = finding.code
            yield LiveFinding(
                code.name, offset, _word_end(file, offset), finding.message, finding.hint, code.severity.value
            )


def _word_end(file: SourceFile, start: int) -> int:
    """Return the end of the word at an offset; at least one character unless at the end of the file."""
    end = start + 1
    while end < len(file.text) and not file.text[end].isspace() and file.text[end] not in "()":
        end += 1
    return min(end, len(file.text))
