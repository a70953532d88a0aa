"""Keys of events: the parts of events that are equal in all runs, separated from names.

A comparison reads each event as a :class:`Token`: the key and the names. Names are the ids that differ
between runs, such as ``gen12``; :mod:`.names` replaces them in the key, and numbers them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, Final, NamedTuple, TypeAlias

from msgspec.structs import replace

from cxbridge.event_kinds import View
from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceWrite,
    PlanActionTransition,
    RuleFired,
    SkillStatus,
)
from cxbridge.history.model import SKILL_ENDED, SKILL_IDLE
from cxbridge.trace.compare.details import MissingDetails
from cxbridge.trace.compare.names import (
    MSGID,
    Namer,
    Names,
    interface_text,
    replace_times_of_day,
    split_msgid,
)
from cxbridge.trace.compare.selection import Selection, compared_contents
from cxbridge.trace.formats.base import Run

Key: TypeAlias = tuple[Any, ...]
"""The kind of an event, followed by the parts of its :class:`KeyForm`."""

NamedKey: TypeAlias = tuple[Key, Names]
"""A key and its names as numbers that are equal in both runs."""

MAX_CHANGED_PARTS: Final = 3
"""The maximum number of differing parts of an event that counts as changed."""

_PLACEHOLDER: Final = re.compile(r"(?:gen|uuid|fact)#")


@dataclass(frozen=True)
class KeyForm:
    """The parts of the key of a kind of event.

    :param kind: the first part of the key.
    :param parts: the other parts: the noun for reports, and the attribute of the event.
    :param thread_length: the number of leading parts, with the kind, that identify the thread of the event:
        its goal, plan, Skiller, interface, or the rules or facts of an environment.
    :param subject_format: the subject in reports as a format string, with the event as ``{0}``.
    :param name_attributes: the attributes with names that differ between runs. Other attributes are not
        searched for names: a class or a mode may look like an id of gensym.
    :param details: the last parts, as ``parts``; they may also contain fact indices and absolute times.
    """

    kind: str
    parts: tuple[tuple[str, str], ...]
    thread_length: int
    subject_format: str
    name_attributes: frozenset[str] = frozenset()
    details: tuple[tuple[str, str], ...] = ()


KEY_FORMS: Final[Mapping[type[Event], KeyForm]] = {
    GoalTransition: KeyForm(
        "goal",
        (
            ("environment", "env"),
            ("id", "goal"),
            ("class", "goal_class"),
            ("sub-type", "sub_type"),
            ("parent", "parent"),
            ("mode", "mode"),
            ("outcome", "outcome"),
            ("error", "error"),
        ),
        thread_length=3,
        subject_format="goal {0.goal} of class {0.goal_class}",
        name_attributes=frozenset({"goal", "parent", "error"}),
        details=(
            ("set of parameters", "params"),
            ("meta value", "meta"),
            ("priority", "priority"),
            ("set of required resources", "resources"),
        ),
    ),
    PlanActionTransition: KeyForm(
        "plan-action",
        (
            ("environment", "env"),
            ("goal", "goal"),
            ("plan", "plan"),
            ("action id", "action_id"),
            ("action", "action"),
            ("state", "state"),
        ),
        thread_length=4,
        subject_format="plan {0.plan} of goal {0.goal}",
        name_attributes=frozenset({"goal", "plan"}),
        details=(("set of parameters", "params"),),
    ),
    SkillStatus: KeyForm(
        "skill",
        (
            ("environment", "env"),
            ("skiller", "skiller"),
            ("skill string", "skill_string"),
            ("status", "status"),
        ),
        thread_length=3,
        subject_format="skiller {0.skiller} of {0.env}",
        name_attributes=frozenset({"skill_string"}),
    ),
    RuleFired: KeyForm(
        "rule",
        (("environment", "env"), ("rule", "rule")),
        thread_length=2,
        subject_format="rules of {0.env}",
    ),
    FactChange: KeyForm(
        "fact",
        (("environment", "env"), ("template", "template"), ("direction", "asserted"), ("text", "text")),
        thread_length=3,
        subject_format="facts {0.template} of {0.env}",
    ),
    InterfaceWrite: KeyForm(
        "interface",
        (("interface", "uid"), ("values", "values")),
        thread_length=2,
        subject_format="{0.uid}",
    ),
}
"""The form of the key of each kind of event."""

DETAIL_NOUNS: Final = frozenset(noun for form in KEY_FORMS.values() for noun, _ in form.details)
"""The nouns of all details, which the text of an event does not show."""

_FORMS_BY_KIND: Final = {form.kind: form for form in KEY_FORMS.values()}


class Token(NamedTuple):
    """An event as a comparison sees it.

    :param names: the names in the parts of the key, in order.
    :param msgid: the message id of the Skiller or interface, see :class:`~.checks.MessageIdCheck`.
    :param number: the number of the event among the compared events, from 0.
    """

    key: Key
    names: Names
    msgid: int | None
    event: Event
    number: int


class TokenReader:
    """Reads the tokens of a run; can be iterated over once.

    :param missing_details: details that are not compared.
    """

    def __init__(
        self,
        run: Run,
        view: View,
        selection: Selection | None = None,
        missing_details: MissingDetails | None = None,
    ) -> None:
        self.count = 0
        self.namer = Namer()
        self._contents = compared_contents(run, view, selection)
        self._skillers = StaleStateFilter()
        self._missing = missing_details or {}

    def __iter__(self) -> Iterator[Token]:
        for content in self._contents:
            number = self.count
            self.count += 1
            # reports number the events of the file, so that dropped states of Skillers count, too
            fresh_content = (
                self._skillers.fresh_state(content) if isinstance(content, SkillStatus) else content
            )
            if fresh_content is not None:
                # the event as recorded, for reports
                yield Token(*self._make_key(fresh_content), content, number)

    def _make_key(self, event: Event) -> tuple[Key, Names, int | None]:
        """Return the key of an event, its names, and the message id."""
        # facts and interfaces have ids within a text, so their keys do not follow KEY_FORMS
        if isinstance(event, FactChange):
            text_without_id, msgid = split_msgid(event.text)
            text, names = self.namer.split(text_without_id, is_fact=True)
            direction = "asserted" if event.asserted else "retracted"
            return ("fact", event.env, event.template, direction, text), names, msgid
        if isinstance(event, InterfaceWrite):
            text, names = self.namer.split(interface_text(event.values), is_fact=True)
            msgid = event.values.get(MSGID)
            return ("interface", event.uid, text), names, msgid if isinstance(msgid, int) else None
        form, missing_details = KEY_FORMS[type(event)], self._missing.get(type(event), ())
        split = self.namer.split
        parts = [
            split(getattr(event, attribute))
            if attribute in form.name_attributes
            else (getattr(event, attribute), ())
            for _, attribute in form.parts
        ]
        parts += [
            split(
                ""
                if attribute in missing_details
                else replace_times_of_day(getattr(event, attribute), event.time_us),
                is_fact=True,
            )
            for _, attribute in form.details
        ]
        key = form.kind, *(part for part, _ in parts)
        names = tuple(chain.from_iterable(part_names for _, part_names in parts))
        return key, names, event.msgid if isinstance(event, SkillStatus) else None


class StaleStateFilter:
    """Shows the states of Skillers as if the Skillers were fresh at the start of the run.

    Until a used Skiller runs a skill, the Skiller shows the end of its last skill, even after an agent has
    acquired control. That state is replaced by the idle state of a fresh Skiller, and its repetitions are
    dropped.
    """

    def __init__(self) -> None:
        # by Skiller, its skill from before the run; empty after its first skill of the run
        self._old_skills: dict[tuple[str, str], str] = {}

    def fresh_state(self, event: SkillStatus) -> SkillStatus | None:
        """Return the state that a fresh Skiller would show, or None for a repetition."""
        skiller = (event.env, event.skiller)
        old_skill = self._old_skills.get(skiller)
        has_ended = event.status in SKILL_ENDED and event.skill_string
        # the first state of the Skiller in the run is the end of a skill of an earlier client
        if old_skill is None and has_ended:
            self._old_skills[skiller] = event.skill_string
            return replace(event, skill_string="", msgid=0, status=SKILL_IDLE)
        if old_skill and has_ended and event.skill_string == old_skill:
            return None
        self._old_skills[skiller] = ""
        return event


def thread_key(key: Key) -> Key:
    """Return the parts of a key that, with their names, identify the thread of the event."""
    return key[: _FORMS_BY_KIND[key[0]].thread_length]


def find_thread(key: Key, names: Names) -> NamedKey:
    """Return the thread of an event: goal, plan, Skiller, interface, or the rules or facts of an agent."""
    parts = thread_key(key)
    return parts, names[: sum(map(_count_names, parts))]


def describe_subject(event: Event) -> str:
    """Return the goal, plan, Skiller or interface of an event."""
    return KEY_FORMS[type(event)].subject_format.format(event)


def find_changed_parts(key_a: NamedKey, key_b: NamedKey) -> list[str]:
    """Return the nouns of the parts in which two events of the same kind differ."""
    (kind, *_), _names = key_a
    form = _FORMS_BY_KIND[kind]
    nouns = (*(noun for noun, _ in form.parts), *(noun for noun, _ in form.details))
    parts = zip(nouns, _parts_with_names(*key_a), _parts_with_names(*key_b), strict=True)
    return [noun for noun, part_a, part_b in parts if part_a != part_b]


def describe_changed_parts(nouns: Sequence[str]) -> str:
    """Return the parts in which two events differ as text."""
    return f"another {' and '.join(nouns)}" if len(nouns) <= MAX_CHANGED_PARTS else "another event"


def _count_names(part: str) -> int:
    return len(_PLACEHOLDER.findall(part))


def _parts_with_names(key: Key, names: Names) -> Iterator[tuple[str, Names]]:
    """Yield each part of a key after the kind, with the names for its placeholders."""
    index = 0
    for part in key[1:]:
        count = _count_names(part)
        yield part, names[index : index + count]
        index += count
