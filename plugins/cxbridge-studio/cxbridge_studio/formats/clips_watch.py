"""Reader of the output of CLIPS 6.30 and 6.4 with watched facts and rules; see docs/formats.md."""

from __future__ import annotations

import re
from collections.abc import Iterator

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact, parse_slots, template_of
from cxbridge.errors import TraceError
from cxbridge.events import Event, FactChange, Level, LogLine, RuleFired
from cxbridge.history.transitions import Transition, TransitionTracker
from cxbridge.trace.formats.base import Format, Run
from cxbridge.trace.formats.fawkes_log import clips_event
from cxbridge.trace.formats.files import MAX_LINE, read_lines

ENV = "executive"
"""The environment of the events, which the text does not contain."""

MAX_FACTS = 100_000
"""The maximal number of remembered facts; the oldest is dropped."""

_STARTS = rb"(?:==>|<==) (?:f-\d+ +\(|Activation -?\d|Focus \S)|FIRE +\d+ [^: ]+:"
_HEAD = re.compile(rb"^(?:" + _STARTS + rb")", re.MULTILINE)
_START = re.compile(_STARTS.decode())
_FACT = re.compile(r"(?:==>|<==) f-\d+ +(\(.*)", re.DOTALL)
_TEMPLATE_FACT = re.compile(r"\([^\s()]+ (?:\.\.\. )?\(")
_GLUED = re.compile(r"(?:==>|<==) f-\d+ +\(.*\)\Z|FIRE (?: {0,3}\d{1,4}|\d{5,}) [^: ]+:(?: [^ ]*)?\Z")
_LEFT_OUT = " ..."
_MAX_TRIES = 200  # joined lines at which a fact without end is given up


class ClipsWatch(Run):
    """The output of CLIPS with ``(watch facts)`` and ``(watch rules)``.

    It has no times, so the numbers of lines are used. Other output becomes log lines.
    """

    format = "clips-watch"
    is_timed = False

    def __iter__(self) -> Iterator[Event]:
        """Yield firings, fact changes with their transitions, and log lines."""
        facts = _WatchedFacts()
        for line, text, whole in self._entries():
            if not whole:
                self.note(f"line {line}: the file ends within this entry")
            event = clips_event(line, ENV, text)
            if event is None:
                yield LogLine(line, Level.DEBUG, f"CLIPS ({ENV})", text)
            elif isinstance(event, FactChange):
                try:
                    change, transition = facts.change(event)
                except FactSyntaxError as error:
                    self.note(f"line {line}: fact f-{event.index} is not readable: {error}")
                    continue
                yield change
                if transition is not None:
                    yield transition
            elif whole or not isinstance(event, RuleFired):
                yield event

    def _entries(self) -> Iterator[tuple[int, str, bool]]:
        """Yield the first line number of each entry, the entry, and whether it is complete."""
        first, lines, size, whole = 0, list[str](), 0, True
        for number, line, ends in read_lines(self.path):
            text = line
            if lines and _START.match(text):
                yield first, "\n".join(lines), True
                lines = []
            if not lines and (glued := _GLUED.search(text)) and not _START.match(text):
                yield number, text[: glued.start()], True  # the program printed no line feed before it
                text = text[glued.start() :]
            if not lines:
                first, size = number, 0
            lines.append(text)
            size += len(text) + 1
            whole = ends
            if size > MAX_LINE:
                raise TraceError(f"an entry of more than {MAX_LINE >> 20} MiB", file=self.path, line=first)
            if ends and not _is_incomplete(lines):
                yield first, "\n".join(lines), True
                lines = []
        if lines:
            yield first, "\n".join(lines), whole


class _WatchedFacts:
    """The present facts."""

    # of a modified fact, CLIPS 6.4 prints only the changed slots
    def __init__(self) -> None:
        self._texts: dict[int, str] = {}
        self._tracker = TransitionTracker(ENV)

    def change(self, event: FactChange) -> tuple[FactChange, Transition | None]:
        """Return the change with the text of the whole fact, and its transition.

        :raises FactSyntaxError: if the fact cannot be parsed.
        """
        text = self._whole_text(event)
        modified = text != event.text
        if modified:
            event = FactChange(event.time_us, ENV, event.asserted, event.index, event.template, text)
        transition = self._tracker.change(event)
        if event.asserted:
            self._remember(event.index, text)
        elif not modified:
            self._texts.pop(event.index, None)
        return event, transition

    def _remember(self, index: int, text: str) -> None:
        """Store the text of a fact and drop the oldest of too many."""
        self._texts.pop(index, None)
        self._texts[index] = text
        if len(self._texts) > MAX_FACTS:
            del self._texts[next(iter(self._texts))]

    def _whole_text(self, event: FactChange) -> str:
        """Return the text of a fact, completed by slots of its previous text."""
        if _LEFT_OUT not in event.text:
            return event.text
        try:
            template, shown, whole = parse_slots(event.text)
        except FactSyntaxError:
            return event.text  # an ordered fact; otherwise readers of its slots report the error
        if whole:
            return event.text
        before = self._texts.get(event.index)
        if before is None:
            raise FactSyntaxError("not all its slots are shown, and it was not asserted before")
        slots = {**parse_fact(before)[1], **shown}
        texts = (f" ({name} {value})" if value else f" ({name})" for name, value in slots.items())
        return f"({template}{''.join(texts)})"


def _is_incomplete(lines: list[str]) -> bool:
    """Return whether lines start a fact that continues after a line feed in a string."""
    match = (
        _FACT.match("\n".join(lines))
        if lines[0].startswith(("==> f-", "<== f-")) and len(lines) < _MAX_TRIES
        else None
    )
    if match is None:
        return len(lines) >= _MAX_TRIES
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
        80,
        recognises=lambda _, head: _HEAD.search(head) is not None,
        reader=f"{__name__}:ClipsWatch",
    ),
)
