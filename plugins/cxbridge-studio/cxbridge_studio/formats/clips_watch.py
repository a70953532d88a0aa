"""Reads the output of CLIPS with watched facts and rules as a recording; see docs/formats.md.

The reader knows the output of CLIPS 6.30 and 6.4.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact, parse_slots, template_of
from cxbridge.errors import TraceError
from cxbridge.events import Event, FactChange, Level, LogLine, RuleFired
from cxbridge.history.transitions import Transition, TransitionTracker
from cxbridge.trace.formats.base import Format, Run
from cxbridge.trace.formats.fawkes_log import parse_clips_event
from cxbridge.trace.formats.files import MAX_LINE_BYTES, read_lines

ENVIRONMENT = "executive"
"""The environment of all events, because the output names no environment."""

MAX_FACTS = 100_000
"""The maximum number of remembered facts, after which the oldest fact is dropped."""

# the beginning of an entry: a fact, an activation, a change of focus, or a firing
_ENTRY_STARTS = rb"(?:==>|<==) (?:f-\d+ +\(|Activation -?\d|Focus \S)|FIRE +\d+ [^: ]+:"
_FIRST_ENTRY = re.compile(rb"^(?:" + _ENTRY_STARTS + rb")", re.MULTILINE)
_ENTRY_START = re.compile(_ENTRY_STARTS.decode())
_FACT = re.compile(r"(?:==>|<==) f-\d+ +(\(.*)", re.DOTALL)
_TEMPLATE_FACT = re.compile(r"\([^\s()]+ (?:\.\.\. )?\(")
# an entry after text that the program has printed in the same line, without a line feed
_ENTRY_AFTER_TEXT = re.compile(
    r"(?:==>|<==) f-\d+ +\(.*\)\Z|FIRE (?: {0,3}\d{1,4}|\d{5,}) [^: ]+:(?: [^ ]*)?\Z"
)
_OMITTED_SLOTS = " ..."  # CLIPS 6.4 prints this in place of the unchanged slots of a modified fact
# A fact with line feeds is parsed again with each further line. After this number of lines, the next entry
# ends the fact.
_MAX_LINES_PER_FACT = 200


class ClipsWatch(Run):
    """The output of CLIPS with ``(watch facts)`` and ``(watch rules)``.

    The output has no times: the time of an event is the number of its line. Any other output becomes log
    lines.
    """

    format = "clips-watch"
    is_timed = False

    def __iter__(self) -> Iterator[Event]:
        """Yield firings, fact changes with their transitions, and log lines."""
        facts = _WatchedFacts()
        for line, text, is_complete in self._read_entries():
            if not is_complete:
                self.note(f"line {line}: the file ends within this entry")
            event = parse_clips_event(line, ENVIRONMENT, text)
            if event is None:
                yield LogLine(line, Level.DEBUG, f"CLIPS ({ENVIRONMENT})", text)
            elif isinstance(event, FactChange):
                try:
                    change, transition = facts.complete_change(event)
                except FactSyntaxError as error:
                    self.note(f"line {line}: fact f-{event.index} is not readable: {error}")
                    continue
                yield change
                if transition is not None:
                    yield transition
            # a firing whose line is cut would have a wrong list of facts
            elif is_complete or not isinstance(event, RuleFired):
                yield event

    def _read_entries(self) -> Iterator[tuple[int, str, bool]]:
        """Yield the first line number and the text of each entry, and whether the entry is complete."""
        first_line, lines, size, is_complete = 0, list[str](), 0, True
        for number, line, has_line_end in read_lines(self.path):
            text = line
            if lines and _ENTRY_START.match(text):
                yield first_line, "\n".join(lines), True
                lines = []
            if not lines and (entry := _ENTRY_AFTER_TEXT.search(text)) and not _ENTRY_START.match(text):
                yield number, text[: entry.start()], True  # the text that the program has printed
                text = text[entry.start() :]
            if not lines:
                first_line, size = number, 0
            lines.append(text)
            size += len(text) + 1
            is_complete = has_line_end  # a line without a line end is the last, and may be cut
            if size > MAX_LINE_BYTES:
                raise TraceError(
                    f"an entry of more than {MAX_LINE_BYTES >> 20} MiB", file=self.path, line=first_line
                )
            if has_line_end and not _is_incomplete(lines):
                yield first_line, "\n".join(lines), True
                lines = []
        if lines:
            yield first_line, "\n".join(lines), is_complete


class _WatchedFacts:
    """The texts of the current facts: CLIPS 6.4 prints only the changed slots of a modified fact."""

    def __init__(self) -> None:
        self._texts: dict[int, str] = {}
        self._tracker = TransitionTracker(ENVIRONMENT)

    def complete_change(self, event: FactChange) -> tuple[FactChange, Transition | None]:
        """Return the change with the text of the whole fact, and its transition, if any.

        :raises FactSyntaxError: if the fact cannot be parsed.
        """
        text = self._complete_text(event)
        is_completed = text != event.text
        if is_completed:
            event = FactChange(event.time_us, ENVIRONMENT, event.asserted, event.index, event.template, text)
        transition = self._tracker.track_change(event)
        if event.asserted:
            self._store_text(event.index, text)
        elif not is_completed:  # a modified fact is asserted next, and needs the slots of its previous text
            self._texts.pop(event.index, None)
        return event, transition

    def _store_text(self, index: int, text: str) -> None:
        """Store the text of a fact, and drop the oldest text if there are too many."""
        self._texts.pop(index, None)
        self._texts[index] = text
        if len(self._texts) > MAX_FACTS:
            del self._texts[next(iter(self._texts))]

    def _complete_text(self, event: FactChange) -> str:
        """Return the text of a fact, completed with the slots of its previous text.

        :raises FactSyntaxError: if slots are omitted and the fact has no previous text.
        """
        if _OMITTED_SLOTS not in event.text:
            return event.text
        try:
            template, shown_slots, is_complete = parse_slots(event.text)
        except FactSyntaxError:
            return event.text  # an ordered fact; otherwise readers of its slots report the error
        if is_complete:
            return event.text
        previous_text = self._texts.get(event.index)
        if previous_text is None:
            raise FactSyntaxError("not all its slots are shown, and it was not asserted before")
        slots = {**parse_fact(previous_text)[1], **shown_slots}
        texts = (f" ({name} {value})" if value else f" ({name})" for name, value in slots.items())
        return f"({template}{''.join(texts)})"


def _is_incomplete(lines: list[str]) -> bool:
    """Return whether the lines are the start of a fact that continues after a line feed in a string."""
    match = (
        _FACT.match("\n".join(lines))
        if lines[0].startswith(("==> f-", "<== f-")) and len(lines) < _MAX_LINES_PER_FACT
        else None
    )
    if match is None:
        return len(lines) >= _MAX_LINES_PER_FACT
    text = match.group(1)
    if not text.endswith(")"):
        return True
    if not template_of(text) or not _TEMPLATE_FACT.match(text):
        return False
    try:
        parse_slots(text)
    except FactSyntaxError:
        return True
    return False


FORMATS = (
    Format(
        "clips-watch",
        rank=80,
        recognises=lambda _, head: _FIRST_ENTRY.search(head) is not None,
        reader=f"{__name__}:ClipsWatch",
    ),
)
