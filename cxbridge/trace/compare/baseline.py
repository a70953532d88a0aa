"""Reads and writes baselines: files of accepted differences, each with a reason; see docs/comparing.md."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import yaml

from cxbridge.errors import TraceError
from cxbridge.file_access import write_file
from cxbridge.trace.compare.model import AcceptedDifference, Comparison, Difference, DifferenceKind
from cxbridge.trace.compare.names import anonymous_fact

TEXTS: Final = ("subject", "what", "a", "b")
"""What an entry can say of a difference, with ``*`` for any text."""

FIELDS: Final = frozenset({*TEXTS, "level", "order", "kind", "times", "reason"})

_NUMBERS: Final = re.compile(r"(?<=f-)\d+ *|(?<=FIRE) +\d+|(?<=msgid=)\d+")


@dataclass(slots=True)
class BaselineEntry:
    """An accepted difference.

    :param texts: what its texts must match, by :data:`TEXTS`; one that is not there may be anything.
    :param times: so many differences it accepts at most; None: any number.
    :param line: where it begins in the file, from 1.
    """

    reason: str
    line: int
    texts: dict[str, str] = field(default_factory=dict)
    level: str = ""
    order: str = ""
    kind: str = ""
    times: int | None = None
    used: int = 0

    def applies(self, comparison: Comparison) -> bool:
        """Whether it is for comparisons of this level and order."""
        return self.level in {"", comparison.view.value} and self.order in {"", comparison.order.value}

    def accepts(self, difference: Difference) -> bool:
        """Whether it accepts this difference."""
        if self.kind not in {"", difference.kind.value}:
            return False
        if self.times is not None and self.used >= self.times:
            return False
        texts = _texts(difference)
        return all(_glob(wanted, texts[name]) for name, wanted in self.texts.items())

    def __str__(self) -> str:
        shown = ", ".join(f"{name} '{text}'" for name, text in self.texts.items())
        return f"line {self.line}: {shown or self.kind}"


def load_baseline(path: Path) -> list[BaselineEntry]:
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
    items = _items(path, node)
    return [_entry(path, item) for item in items]


def _items(path: Path, node: yaml.Node) -> list[yaml.Node]:
    """Return the entries of a document."""
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if key.value == "differences" and isinstance(value, yaml.SequenceNode):
                return list(value.value)
    raise TraceError(
        "is not a baseline: a mapping with a list 'differences' is wanted",
        file=path,
        line=node.start_mark.line + 1,
        hint="--write-baseline makes one",
    )


def _entry(path: Path, node: yaml.Node) -> BaselineEntry:
    """Return an entry."""
    line = node.start_mark.line + 1
    value: Any = yaml.SafeLoader("").construct_document(node)
    if not isinstance(value, dict):
        raise TraceError("an entry that is not a mapping", file=path, line=line)
    unknown = [str(name) for name in value if name not in FIELDS]
    if unknown:
        hint = f"use {', '.join(sorted(FIELDS))}"
        raise TraceError(f"an entry with an unknown field '{unknown[0]}'", file=path, line=line, hint=hint)
    reason = value.get("reason")
    if not isinstance(reason, str) or not reason.strip():
        raise TraceError("an entry without a reason", file=path, line=line, hint="say why it is accepted")
    times = value.get("times")
    if times is not None and (type(times) is not int or times < 1):
        raise TraceError("'times' is a number from 1", file=path, line=line)
    texts = {name: str(value[name]) for name in TEXTS if value.get(name) is not None}
    kind = str(value.get("kind", ""))
    if kind and kind not in {each.value for each in DifferenceKind}:
        hint = f"use one of {', '.join(each.value for each in DifferenceKind)}"
        raise TraceError(f"no kind of difference: '{kind}'", file=path, line=line, hint=hint)
    if not texts and not kind:
        hint = f"say what it is about: {', '.join(TEXTS)} or kind"
        raise TraceError("an entry that accepts everything", file=path, line=line, hint=hint)
    level, order = str(value.get("level", "")), str(value.get("order", ""))
    return BaselineEntry(reason.strip(), line, texts, level, order, kind, times)


def accept(comparison: Comparison, entries: Sequence[BaselineEntry]) -> list[BaselineEntry]:
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
            comparison.accepted.append(AcceptedDifference(difference, entry.reason))
    if left != comparison.differences:
        comparison.set_first(left)
    return [entry for entry in mine if not entry.used]


def write_baseline(path: Path, comparison: Comparison, reason: str) -> int:
    """Write a baseline that accepts what a comparison found, and what was accepted; return how many entries.

    :param reason: for those that have none yet; empty: to be written into the file by hand.
    :raises TraceError: when it cannot be written, or more was found than is kept.
    """
    if comparison.dropped:
        found = comparison.total
        raise TraceError(
            f"{found} differences are too many to accept", hint="are these runs of one scenario?"
        )
    entries = list(_plain(comparison, reason))
    text = yaml.safe_dump({"differences": entries}, sort_keys=False, allow_unicode=True, width=110)
    write_file(path, f"{_HEAD}{text}")
    return len(entries)


_HEAD = """\
# Accepted differences of `cxbridge trace diff --baseline`. Each entry needs a reason.
# `*` is any text, a field that is left out may be anything.
"""


def _plain(comparison: Comparison, reason: str) -> Iterator[dict[str, Any]]:
    """Yield the differences as entries, equal ones together."""
    known: dict[tuple[str, ...], dict[str, Any]] = {}
    reasoned = [(each.difference, each.reason) for each in comparison.accepted]
    for difference, why in [*reasoned, *((each, reason) for each in comparison.differences)]:
        texts = _texts(difference)
        key = (difference.kind.value, *texts.values(), why)
        if key in known:
            known[key]["times"] += 1
            continue
        known[key] = {
            "level": comparison.view.value,
            "order": comparison.order.value,
            "kind": difference.kind.value,
            **texts,
            "times": 1,
            "reason": why,
        }
    yield from known.values()


def _texts(difference: Difference) -> dict[str, str]:
    """Return the texts of a difference without accidental names and numbers."""
    texts = (difference.subject, difference.what, difference.a.text, difference.b.text)
    return {name: _NUMBERS.sub("#", anonymous_fact(text)) for name, text in zip(TEXTS, texts, strict=True)}


def _glob(wanted: str, text: str) -> bool:
    """Whether a text is as wanted: ``*`` is any text, itself too."""
    parts = [re.escape(part) for part in _NUMBERS.sub("#", anonymous_fact(wanted)).split("*")]
    return re.fullmatch(".*".join(parts), text, re.DOTALL) is not None
