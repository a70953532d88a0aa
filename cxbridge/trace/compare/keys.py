"""Keys of events: the parts of events that are equal in all runs, separated from names.

A comparison reads each event as a :class:`Token`: the key and the names. Names are the ids that differ
between runs, such as ``gen12``; :mod:`.names` replaces them in the key, and numbers them.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from operator import attrgetter
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
_END_STATUSES: Final = ("S_FINAL", "S_FAILED")
_IDLE_STATUS: Final = "S_INACTIVE"


@dataclass(frozen=True)
class KeyForm:
    """The parts of the key of a kind of event.

    :param kind: the first part of the key.
    :param parts: the other parts: the noun for reports, and the attribute of the event.
    :param thread_length: the number of leading parts, with the kind, that identify the thread of the event:
        its goal, plan, Skiller, interface, or the rules or facts of an environment.
    :param subject_format: the subject in reports as a format string, with the event as ``{0}``.
    :param name_attributes: the attributes with names that differ between runs.
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

_FORMS_BY_KIND: Final = {form.kind: form for form in KEY_FORMS.values()}

# The number of leading parts of a key, with the kind, that identify the subject of the event.
_SUBJECT_LENGTHS: Final = {
    form.kind: len(event_type.KIND.subject) + 1 for event_type, form in KEY_FORMS.items()
}


class Token(NamedTuple):
    """An event as a comparison sees it.

    :param names: the names in the parts of the key, in order.
    :param thread_name_count: the number of names in the parts that identify the thread.
    :param msgid: the message id of the Skiller or interface, see :class:`~.checks.MessageIdCheck`.
    :param number: the number of the event among the compared events, from 0.
    """

    key: Key
    names: Names
    thread_name_count: int
    msgid: int | None
    event: Event
    number: int

    @property
    def thread(self) -> tuple[Key, Names]:
        """The thread of the event: goal, plan, Skiller, interface, or the rules or facts of an agent."""
        return thread_key(self.key), self.names[: self.thread_name_count]


class TokenReader:
    """Reads the tokens of a run; can be iterated over once.

    :param missing: details that are not compared.
    """

    def __init__(
        self,
        run: Run,
        view: View,
        selection: Selection | None = None,
        missing: MissingDetails | None = None,
    ) -> None:
        self.count = 0
        self.namer = Namer()
        self._contents = compared_contents(run, view, selection)
        self._skillers = SkillerBacklog()
        self._key_makers = {
            event_type: _KeyMaker(form, self.namer, (missing or {}).get(event_type, frozenset()))
            for event_type, form in KEY_FORMS.items()
        }

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

    def _make_key(self, event: Event) -> tuple[Key, Names, int, int | None]:
        """Return the key of an event, its names, the number of names in the thread, and the message id."""
        if isinstance(event, FactChange):
            text_without_id, msgid = split_msgid(event.text)
            text, names = self.namer.split(text_without_id, is_fact=True)
            direction = "asserted" if event.asserted else "retracted"
            return ("fact", event.env, event.template, direction, text), names, 0, msgid
        if isinstance(event, InterfaceWrite):
            text, names = self.namer.split(interface_text(event.values), is_fact=True)
            msgid = event.values.get(MSGID)
            return ("interface", event.uid, text), names, 0, msgid if isinstance(msgid, int) else None
        msgid = event.msgid if isinstance(event, SkillStatus) else None
        return *self._key_makers[type(event)].make_key(event), msgid


class _KeyMaker:
    """Makes the keys of one kind of event.

    :param namer: separates the names from the parts.
    :param missing: details that are not compared.
    """

    def __init__(self, form: KeyForm, namer: Namer, missing: Collection[str]) -> None:
        self._kind = form.kind
        self._read_values = attrgetter(*(attribute for _, attribute in (*form.parts, *form.details)))
        self._named_indices = [
            index for index, (_, attribute) in enumerate(form.parts) if attribute in form.name_attributes
        ]
        first_detail = len(form.parts)
        self._details = [
            (index, attribute in missing) for index, (_, attribute) in enumerate(form.details, first_detail)
        ]
        self._thread_length = form.thread_length - 1  # without the kind
        self._namer = namer

    def make_key(self, event: Event) -> tuple[Key, Names, int]:
        """Return the key, its names, and the number of names in the thread."""
        values = list(self._read_values(event))
        names: Names = ()
        thread_name_count = 0
        # other attributes are not searched for names: a class or a mode may look like an id of gensym
        for index in self._named_indices:
            values[index], part_names = self._namer.split(values[index])
            names += part_names
            if index < self._thread_length:
                thread_name_count = len(names)
        for index, is_missing in self._details:
            detail = "" if is_missing else replace_times_of_day(values[index], event.time_us)
            values[index], part_names = self._namer.split(detail, is_fact=True)
            names += part_names
        return (self._kind, *values), names, thread_name_count


class SkillerBacklog:
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
        has_ended = event.status in _END_STATUSES and event.skill_string
        # the first state of the Skiller in the run is the end of a skill of an earlier client
        if old_skill is None and has_ended:
            self._old_skills[skiller] = event.skill_string
            return replace(event, skill_string="", msgid=0, status=_IDLE_STATUS)
        if old_skill and has_ended and event.skill_string == old_skill:
            return None
        self._old_skills[skiller] = ""
        return event


def thread_key(key: Key) -> Key:
    """Return the parts of a key that, with their names, identify the thread of the event."""
    return key[: _FORMS_BY_KIND[key[0]].thread_length]


def describe_subject(event: Event) -> str:
    """Return the goal, plan, Skiller or interface of an event."""
    return KEY_FORMS[type(event)].subject_format.format(event)


def describe_changed_parts(key_a: NamedKey, key_b: NamedKey) -> str:
    """Return the parts in which two events differ as text."""
    if key_a[0][0] != key_b[0][0]:
        return "another event"
    form = _FORMS_BY_KIND[key_a[0][0]]
    parts = zip(
        (*form.parts, *form.details), _parts_with_names(*key_a), _parts_with_names(*key_b), strict=True
    )
    nouns = [noun for (noun, _), a, b in parts if a != b]
    if not nouns or len(nouns) > MAX_CHANGED_PARTS:
        return "another event"
    return "another " + " and ".join(nouns)


def detail_change(key_a: NamedKey, key_b: NamedKey) -> Key | None:
    """Return the difference between two events if only details differ, else None.

    :returns: the parts that identify the goal or plan-action, and the details of both events.
    """
    kind = key_a[0][0]
    form = _FORMS_BY_KIND[kind]
    if kind != key_b[0][0] or not form.details:
        return None
    parts_a, parts_b, start = (
        list(_parts_with_names(*key_a)),
        list(_parts_with_names(*key_b)),
        len(form.parts),
    )
    if parts_a[:start] != parts_b[:start]:
        return None
    return (*parts_a[: _SUBJECT_LENGTHS[kind] - 1], *parts_a[start:], *parts_b[start:])


def _parts_with_names(key: Key, names: Names) -> Iterator[tuple[str, Names]]:
    """Yield each part of a key after the kind, with the names for its placeholders."""
    index = 0
    for part in key[1:]:
        count = len(_PLACEHOLDER.findall(part))
        yield part, names[index : index + count]
        index += count
