"""Reads what CLIPS 6.30 and 6.4 print when facts and rules are watched; see docs/formats.md."""

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
"""The environment that the events are said to be of; the text does not tell."""

MAX_FACTS = 100_000
"""The number of remembered facts; then the oldest is forgotten."""

_STARTS = rb"(?:==>|<==) (?:f-\d+ +\(|Activation -?\d|Focus \S)|FIRE +\d+ [^: ]+:"
_HEAD = re.compile(rb"^(?:" + _STARTS + rb")", re.MULTILINE)
_START = re.compile(_STARTS.decode())
_FACT = re.compile(r"(?:==>|<==) f-\d+ +(\(.*)", re.DOTALL)
_TEMPLATE_FACT = re.compile(r"\([^\s()]+ (?:\.\.\. )?\(")
_GLUED = re.compile(r"(?:==>|<==) f-\d+ +\(.*\)\Z|FIRE (?: {0,3}\d{1,4}|\d{5,}) [^: ]+:(?: [^ ]*)?\Z")
_LEFT_OUT = " ..."
_MAX_TRIES = 200


class ClipsWatch(Run):
    """What CLIPS printed while ``(watch facts)`` and ``(watch rules)`` were on.

    It has no times: they are the numbers of the lines. Other output becomes lines of a log.
    """

    format = "clips-watch"

    def __iter__(self) -> Iterator[Event]:
        """Yield firings and fact changes, after a fact the transition that it means, and lines of a log."""
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
        """Yield the line that an entry begins in, the entry, and False for a last one without its end."""
        first, lines, size, whole = 0, list[str](), 0, True
        for number, line, ends in read_lines(self.path):
            text = line
            if lines and _START.match(text):
                yield first, "\n".join(lines), True
                lines = []
            if not lines and (glued := _GLUED.search(text)) and not _START.match(text):
                yield number, text[: glued.start()], True  # the program printed no line feed
                text = text[glued.start() :]
            if not lines:
                first, size = number, 0
            lines.append(text)
            size += len(text) + 1
            whole = ends
            if size > MAX_LINE:
                raise TraceError(f"an entry of more than {MAX_LINE >> 20} MiB", file=self.path, line=first)
            if ends and not _goes_on(lines):
                yield first, "\n".join(lines), True
                lines = []
        if lines:
            yield first, "\n".join(lines), whole


class _WatchedFacts:
    """The facts there are: CLIPS 6.4 shows of a modified one only the slots that changed."""

    def __init__(self) -> None:
        self._texts: dict[int, str] = {}
        self._tracker = TransitionTracker(ENV)

    def change(self, event: FactChange) -> tuple[FactChange, Transition | None]:
        """Return the change with the text of the whole fact, and the transition that it means.

        :raises FactSyntaxError: when the fact cannot be read.
        """
        text = self._whole(event)
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
        """Keep the text of a fact, and forget the oldest when there are too many."""
        self._texts.pop(index, None)
        self._texts[index] = text
        if len(self._texts) > MAX_FACTS:
            del self._texts[next(iter(self._texts))]

    def _whole(self, event: FactChange) -> str:
        """Return the text of a fact of which not all slots may be shown, with those that it had before."""
        if _LEFT_OUT not in event.text:
            return event.text
        try:
            template, shown, whole = parse_slots(event.text)
        except FactSyntaxError:
            return event.text  # an ordered fact; if it is not, readers of its slots will report it
        if whole:
            return event.text
        before = self._texts.get(event.index)
        if before is None:
            raise FactSyntaxError("not all its slots are shown, and it was not asserted before")
        slots = {**parse_fact(before)[1], **shown}
        texts = (f" ({name} {value})" if value else f" ({name})" for name, value in slots.items())
        return f"({template}{''.join(texts)})"


def _goes_on(lines: list[str]) -> bool:
    """Whether these lines begin a fact whose end is still to come, as a string in it holds a line feed."""
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
