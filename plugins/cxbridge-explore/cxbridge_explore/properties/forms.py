"""The parser of properties such as ``never (goal (outcome FAILED))`` or ``after (a) then (b) within 10``."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, compact, read_nodes
from cxbridge.config.documents import Mark
from cxbridge.suggestions import did_you_mean
from cxbridge_explore.properties.monitor import Monitor, Property, Scene
from cxbridge_explore.properties.patterns import ConditionPattern
from cxbridge_explore.properties.temporal import AfterMonitor, AlwaysMonitor, EventuallyMonitor, NeverMonitor

FORMS: Final = (
    "never (PATTERN)",
    "always (PATTERN)",
    "eventually (PATTERN) [within SECONDS]",
    "after (PATTERN) then (PATTERN) [within SECONDS]",
)

_FORM_WORDS: Final = ("never", "always", "eventually", "after")  # in the order of `FORMS`
_NAME_PATTERN: Final = re.compile(r"\s*([\w-]+)\s*:")  # the optional `NAME:` before a form
_NON_PATTERN_HEADS: Final = frozenset({"test", "declare"})  # first words of elements that match no fact


@dataclass(slots=True)
class _FormReader:
    """Reads the parts of a form from left to right.

    :param text: the whole form, for error messages.
    :param nodes: the parts that are not read yet.
    :param mark: the position, for error messages.
    """

    text: str
    nodes: list[SyntaxNode]
    mark: Mark

    def read_word(self) -> str:
        """Read a word; empty if the next part is not a word."""
        if self.nodes and self.nodes[0].items is None:
            return self.nodes.pop(0).text
        return ""

    def read_pattern(self, keyword: str) -> ConditionPattern:
        """Read conditional elements, which must include a pattern.

        :param keyword: the word before the elements, for error messages.
        :raises ConfigError: if no element is a pattern.
        """
        nodes: list[SyntaxNode] = []
        while self.nodes and self.nodes[0].items is not None:
            nodes.append(self.nodes.pop(0))
        if not any(node.head and node.head not in _NON_PATTERN_HEADS for node in nodes):
            raise self.mark.error(
                f"'{keyword}' needs a pattern: {self.text}",
                "write a pattern in parentheses: (goal (outcome FAILED))",
            )
        return ConditionPattern(tuple(nodes), self.mark)

    def read_limit(self) -> float | None:
        """Read the optional time limit in seconds, the last part of a form; None without a limit.

        :raises ConfigError: if the limit is not a positive number, or the form has further parts.
        """
        word, limit = self.read_word(), None
        if word == "within":
            seconds_text = self.read_word()
            limit = _parse_seconds(seconds_text)
            if limit is None:
                raise self.mark.error(
                    f"'within' must be followed by seconds, not by '{seconds_text}': {self.text}",
                    "write e.g. within 30",
                )
            word = self.read_word()
        if word or self.nodes:
            surplus_text = word or self.nodes[0].text
            raise self.mark.error(
                f"'{surplus_text}' does not belong in a property: {self.text}",
                did_you_mean(surplus_text, ("within", "then"), f"the forms are: {'; '.join(FORMS)}"),
            )
        return limit


def _parse_seconds(text: str) -> float | None:
    """Return a time limit; None if the text is not a positive finite number."""
    try:
        seconds = float(text)
    except ValueError:
        return None
    return seconds if 0 < seconds < float("inf") else None


def read_property(text: str, mark: Mark | None = None) -> Property:
    """Parse the text form of a property: ``[NAME:] FORM``.

    Unknown deftemplates are reported later, when the property is watched.

    :param mark: the position for error messages.
    :raises ConfigError: if the text is not a property.
    """
    mark = mark or Mark()
    match = _NAME_PATTERN.match(text)
    body = text[match.end() :] if match else text
    # checked here, since `read_nodes` leaves out the content of an unclosed list
    if body.count("(") != body.count(")"):
        raise mark.error(f"the parentheses of a property do not match: {text.strip()}")
    reader = _FormReader(text.strip(), read_nodes(body), mark)
    name = match[1] if match else compact(body)
    keyword = reader.read_word()
    make_monitor: Callable[[Scene], Monitor]
    if keyword not in _FORM_WORDS:
        hint = did_you_mean(keyword, _FORM_WORDS, f"the forms are: {'; '.join(FORMS)}")
        raise mark.error(f"a property must begin with {', '.join(_FORM_WORDS)}, not with '{keyword}'", hint)
    pattern = reader.read_pattern(keyword)
    match keyword:
        case "eventually":
            make_monitor = partial(EventuallyMonitor, pattern=pattern, within_s=reader.read_limit())
        case "after":
            if reader.read_word() != "then":
                raise mark.error(f"'after' needs a 'then': {text.strip()}", FORMS[_FORM_WORDS.index(keyword)])
            later_pattern = reader.read_pattern("then")
            make_monitor = partial(
                AfterMonitor,
                first_pattern=pattern,
                second_pattern=later_pattern,
                within_s=reader.read_limit(),
            )
        case _:
            make_monitor = partial(NeverMonitor if keyword == "never" else AlwaysMonitor, pattern=pattern)
    # "eventually" and "after" have read their limits
    if reader.read_limit() is not None:
        raise mark.error(
            f"'{keyword}' cannot have a time limit: {text.strip()}",
            f"the form is: {FORMS[_FORM_WORDS.index(keyword)]}",
        )
    return Property(name, make_monitor, compact(body), compact(text))
