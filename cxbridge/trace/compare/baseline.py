"""Reads and writes baselines: files of accepted differences, each with a reason; see docs/comparing.md."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import yaml
from msgspec import Meta, Struct, ValidationError, convert

from cxbridge.errors import TraceError
from cxbridge.event_kinds import View
from cxbridge.file_access import write_file
from cxbridge.trace.compare.model import (
    AcceptedDifference,
    Comparison,
    Difference,
    DifferenceKind,
    Order,
)
from cxbridge.trace.compare.names import anonymous_fact

TEXTS: Final = ("subject", "what", "a", "b")
"""What an entry can say of a difference, with ``*`` for any text."""

_NUMBERS: Final = re.compile(r"(?<=f-)\d+ *|(?<=FIRE) +\d+|(?<=msgid=)\d+")


class BaselineEntry(Struct, forbid_unknown_fields=True, omit_defaults=True, kw_only=True):
    """An accepted difference of a file; an empty field accepts any value.

    :param times: the number of differences that it accepts at most; None: any number.
    """

    level: View | None = None
    order: Order | None = None
    kind: DifferenceKind | None = None
    subject: str = ""
    what: str = ""
    a: str = ""
    b: str = ""
    times: Annotated[int, Meta(ge=1)] | None = None
    reason: Annotated[str, Meta(pattern=r"\S")]

    @property
    def texts(self) -> dict[str, str]:
        """The patterns for the texts of a difference."""
        return {name: text for name in TEXTS if (text := getattr(self, name))}


@dataclass(slots=True)
class ReadEntry:
    """An entry of a file.

    :param line: where it begins, from 1.
    :param used: the number of differences that it has accepted.
    """

    entry: BaselineEntry
    line: int
    used: int = 0

    def applies(self, comparison: Comparison) -> bool:
        """Whether it is for comparisons of this level and order."""
        level, order = self.entry.level, self.entry.order
        return level in {None, comparison.view} and order in {None, comparison.order}

    def accepts(self, difference: Difference) -> bool:
        """Whether it accepts this difference."""
        entry, texts = self.entry, _texts(difference)
        if entry.kind not in {None, difference.kind} or (entry.times and self.used >= entry.times):
            return False
        return all(_glob(wanted, texts[name]) for name, wanted in entry.texts.items())

    def __str__(self) -> str:
        shown = ", ".join(f"{name} '{text}'" for name, text in self.entry.texts.items())
        return f"line {self.line}: {shown or (self.entry.kind and self.entry.kind.value)}"


def load_baseline(path: Path) -> list[ReadEntry]:
    """Read a baseline.

    :raises TraceError: when it is none; says where and why.
    """
    try:
        node = yaml.compose(path.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
    except OSError as error:
        raise TraceError(f"cannot be read: {error.strerror}", file=path) from error
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        line = None if mark is None else mark.line + 1
        raise TraceError("is not YAML", file=path, line=line, hint=getattr(error, "problem", None)) from error
    if node is None:
        return []
    lists = (
        []
        if not isinstance(node, yaml.MappingNode)
        else [
            value
            for key, value in node.value
            if key.value == "differences" and isinstance(value, yaml.SequenceNode)
        ]
    )
    if not lists:
        raise TraceError(
            "is not a baseline: a mapping with a list 'differences' is wanted",
            file=path,
            line=node.start_mark.line + 1,
            hint="--write-baseline makes one",
        )
    return [_entry(path, item) for item in lists[0].value]


def _entry(path: Path, node: yaml.Node) -> ReadEntry:
    """Return an entry."""
    line = node.start_mark.line + 1
    try:
        entry = convert(yaml.SafeLoader("").construct_document(node), BaselineEntry)
    except (ValidationError, yaml.YAMLError) as error:
        hint = f"an entry has {', '.join(BaselineEntry.__struct_fields__)}; reason must be there"
        raise TraceError(f"is no entry of a baseline: {error}", file=path, line=line, hint=hint) from error
    if not entry.texts and not entry.kind:
        hint = f"say what it is about: {', '.join(TEXTS)} or kind"
        raise TraceError("an entry that accepts everything", file=path, line=line, hint=hint)
    return ReadEntry(entry, line)


def accept(comparison: Comparison, entries: Sequence[ReadEntry]) -> list[ReadEntry]:
    """Move the differences that a baseline lists to the accepted ones; return entries that met none.

    Entries for other levels and orders are left alone.
    """
    mine = [entry for entry in entries if entry.applies(comparison)]
    left = []
    for difference in comparison.differences:
        entry = next((entry for entry in mine if entry.accepts(difference)), None)
        if entry is None:
            left.append(difference)
        else:
            entry.used += 1
            comparison.accepted.append(AcceptedDifference(difference, entry.entry.reason.strip()))
    if left != comparison.differences:
        comparison.set_first(left)
    return [entry for entry in mine if not entry.used]


def write_baseline(path: Path, comparison: Comparison, reason: str) -> int:
    """Write a baseline that accepts the found and the accepted differences; return the number of entries.

    :param reason: for those that have none yet; empty: to be written into the file by hand.
    :raises TraceError: when it cannot be written, or more was found than is kept.
    """
    if comparison.dropped:
        found = comparison.total
        raise TraceError(
            f"{found} differences are too many to accept", hint="are these runs of one scenario?"
        )
    entries = list(_entries(comparison, reason))
    text = yaml.safe_dump({"differences": entries}, sort_keys=False, allow_unicode=True, width=110)
    write_file(path, f"{_HEAD}{text}")
    return len(entries)


_HEAD = """\
# Accepted differences of `cxbridge trace diff --baseline`. Each entry needs a reason.
# `*` is any text, a field that is left out may be anything.
"""


def _entries(comparison: Comparison, reason: str) -> Iterator[dict[str, Any]]:
    """Yield the differences as entries, equal ones together."""
    reasoned = [(each.difference, each.reason) for each in comparison.accepted]
    found = [*reasoned, *((each, reason) for each in comparison.differences)]
    counts = Counter((each.kind, tuple(_texts(each).items()), why) for each, why in found)
    for (kind, texts, why), times in counts.items():
        about = {"level": comparison.view, "order": comparison.order, "kind": kind}
        plain = {name: value.value for name, value in about.items()}
        yield {**plain, **dict(texts), "times": times, "reason": why}


def _texts(difference: Difference) -> dict[str, str]:
    """Return the texts of a difference without accidental names and numbers."""
    texts = (difference.subject, difference.what, difference.a.text, difference.b.text)
    return {name: _NUMBERS.sub("#", anonymous_fact(text)) for name, text in zip(TEXTS, texts, strict=True)}


def _glob(wanted: str, text: str) -> bool:
    """Whether a text is as wanted: ``*`` is any text, itself too."""
    parts = [re.escape(part) for part in _NUMBERS.sub("#", anonymous_fact(wanted)).split("*")]
    return re.fullmatch(".*".join(parts), text, re.DOTALL) is not None
