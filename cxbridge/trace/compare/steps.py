"""The steps of a run: its compared events, from whose texts the names that differ between runs are separated.

Names are ids such as ``gen12``; :mod:`.names` replaces them in the key of a step, and numbers them. Steps
have no events, so that long runs fit into memory: the events of the differences are read again.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
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
    SkillStatus,
)
from cxbridge.history.model import SKILL_ENDED, SKILL_IDLE
from cxbridge.trace.compare.names import (
    MSGID,
    PLACEHOLDER,
    Namer,
    Names,
    interface_text,
    replace_times,
    replace_times_of_day,
    split_msgid,
)
from cxbridge.trace.compare.selection import Selection, compared_contents
from cxbridge.trace.formats.base import Run

Key: TypeAlias = tuple[str, ...]
"""The kind of an event, followed by the fields of its :class:`KeyForm`."""

NamedKey: TypeAlias = tuple[Key, Names]
"""A key and its names."""

MAX_NAMED_CHANGES: Final = 3
"""The maximum number of differing fields that a report names; chosen freely for a short line."""

TYPES_WITH_DETAILS: Final = (GoalTransition, PlanActionTransition)
"""The types of events with details, such as parameters."""


class KeyForm(NamedTuple):
    """The form of the key of a kind of event: the fields of the event in the key.

    :param thread: the fields that identify the goal, plan, Skiller or interface of the event, or the rules or
        facts of an environment.
    :param other_fields: the fields besides those of the thread.
    :param subject_format: the thread in reports as a format string, with the event as ``{0}``; empty for
        details, which reports show with their event.
    """

    thread: tuple[str, ...]
    other_fields: tuple[str, ...]
    subject_format: str


KEY_FORMS: Final[Mapping[str, KeyForm]] = {
    "goal": KeyForm(
        ("env", "goal"),
        ("goal_class", "sub_type", "parent", "mode", "outcome", "error"),
        "goal {0.goal} of class {0.goal_class}",
    ),
    "plan-action": KeyForm(
        ("env", "goal", "plan"), ("action_id", "action", "state"), "plan {0.plan} of goal {0.goal}"
    ),
    "skill": KeyForm(("env", "skiller"), ("skill_string", "status"), "skiller {0.skiller} of {0.env}"),
    "rule": KeyForm(("env",), ("rule",), "rules of {0.env}"),
    "fact": KeyForm(("env", "template"), ("asserted", "text"), "facts {0.template} of {0.env}"),
    "interface": KeyForm(("uid",), ("values",), "{0.uid}"),
    **{
        f"{event_type.KIND.name} details": KeyForm(
            event_type.KIND.subject_fields, event_type.KIND.detail_fields, ""
        )
        for event_type in TYPES_WITH_DETAILS
    },
}
"""The form of the key of each kind of event, and of the details of goals and plan-actions."""

DETAIL_KINDS: Final = frozenset(kind for kind in KEY_FORMS if kind.endswith(" details"))
"""The kinds of keys of details."""

_NAMED_FIELDS: Final = frozenset(
    {"goal", "parent", "error", "plan", "skill_string", "text", "values"}
    | {field for event_type in TYPES_WITH_DETAILS for field in event_type.KIND.detail_fields}
)
"""The fields with names that differ between runs; a class or a mode may look like an id of gensym."""

_FIELD_GETTERS: Final = {
    kind: attrgetter(*form.thread, *form.other_fields) for kind, form in KEY_FORMS.items()
}

_NAMED_PARTS: Final = {
    kind: [
        index for index, field in enumerate((*form.thread, *form.other_fields), 1) if field in _NAMED_FIELDS
    ]
    for kind, form in KEY_FORMS.items()
}
"""The indices of the parts of keys that may have names."""

_NOUNS: Final = {
    "env": "environment",
    "goal_class": "class",
    "sub_type": "sub-type",
    "action_id": "action id",
    "skill_string": "skill string",
    "asserted": "direction",
    "params": "set of parameters",
    "meta": "meta value",
    "resources": "set of required resources",
}
"""The nouns of fields for reports, where they are not the names of the fields."""

MissingDetails: TypeAlias = Mapping[str, frozenset[str]]
"""The details, such as parameters, that at least one of the compared runs does not record, by kind."""


class Step(NamedTuple):
    """A compared event.

    :param names: the names in the key, in order, as numbers by first appearance in the run.
    :param position: the number of the event among the compared events, from 0.
    :param msgid: the message id in a fact, or in the state of a Skiller or interface, see
        :class:`~.checks.PairChecks`; None without such an id.
    :param details: the key of the details, such as parameters, if they differ from those of the preceding
        event of the same goal or plan-action.
    """

    key: Key
    names: Names
    position: int
    time_us: int
    msgid: int | None = None
    details: NamedKey | None = None

    @property
    def subject(self) -> NamedKey:
        """The goal or plan-action of the details, or the thread of an event without details."""
        form = KEY_FORMS.get(f"{self.key[0]} details", KEY_FORMS[self.key[0]])
        return self._first_fields(len(form.thread))

    @property
    def content(self) -> NamedKey:
        """The part of the step that must be equal in both runs."""
        return self.key, self.names

    @property
    def thread(self) -> NamedKey:
        """The goal, plan, Skiller or interface, or the rules or facts of an environment."""
        return self._first_fields(len(KEY_FORMS[self.key[0]].thread))

    def _first_fields(self, count: int) -> NamedKey:
        parts = self.key[: count + 1]
        return parts, self.names[: sum(len(PLACEHOLDER.findall(part)) for part in parts)]


class StepReader:
    """Reads the steps of a run.

    :param missing_details: details that are not compared.
    :param shared: the keys and names so far, by themselves, so that equal keys share one object in memory;
        the same dictionary for all compared runs.
    :ivar count: the number of compared events so far.
    """

    def __init__(
        self, missing_details: MissingDetails | None = None, shared: dict[Any, Any] | None = None
    ) -> None:
        self.count = 0
        self._missing_details = missing_details or {}
        self._shared = {} if shared is None else shared
        self._namer = Namer()
        self._skiller_filter = StaleStateFilter()
        self._last_details: dict[Key, tuple[Key, Key]] = {}

    def read(self, run: Run, view: View, selection: Selection | None = None) -> Iterator[tuple[Step, Event]]:
        """Yield the steps of the run with their events."""
        for event in compared_contents(run, view, selection):
            # reports number the compared events of the file, so that dropped states of Skillers count, too
            fresh_event = self._skiller_filter.fresh_state(event) if isinstance(event, SkillStatus) else event
            if fresh_event is not None:
                yield self._make_step(fresh_event), fresh_event
            self.count += 1

    def _make_step(self, event: Event) -> Step:
        kind = event.KIND.name
        msgid, details, has_fact_names = None, None, False
        texts = _FIELD_GETTERS[kind](event)
        if isinstance(event, TYPES_WITH_DETAILS):
            details = self._find_new_details(event)
        elif isinstance(event, SkillStatus):
            msgid = event.msgid
        # facts and interfaces have their message id within the compared text or values
        elif isinstance(event, FactChange):
            has_fact_names = True
            text, msgid = split_msgid(event.text)
            texts = (event.env, event.template, "==>" if event.asserted else "<==", text)
        elif isinstance(event, InterfaceWrite):
            has_fact_names = True
            value = event.values.get(MSGID)
            msgid = value if isinstance(value, int) else None
            texts = (event.uid, interface_text(event.values))
        key, names = self._split(kind, texts, has_fact_names=has_fact_names)
        return Step(key, names, self.count, event.time_us, msgid, details)

    def _split(self, kind: str, texts: Sequence[str], *, has_fact_names: bool) -> NamedKey:
        """Return the texts of fields as a key, and their names.

        :param has_fact_names: whether fact indices are names, and absolute times are replaced.
        """
        names: Names = ()
        parts = [kind, *texts]
        for index in _NAMED_PARTS[kind]:
            parts[index], part_names = self._namer.split(parts[index], has_fact_names=has_fact_names)
            names += part_names
        key = tuple(parts)
        return self._shared.setdefault(key, key), self._shared.setdefault(names, names)

    def _find_new_details(self, event: GoalTransition | PlanActionTransition) -> NamedKey | None:
        """Return the key of the details of an event, or None.

        None means that the details of the goal or action are unchanged, or that the run has no details.
        """
        kind = f"{event.KIND.name} details"
        recorded = _FIELD_GETTERS[kind](event)
        subject_length = len(KEY_FORMS[kind].thread)
        subject = (kind, *recorded[:subject_length])
        last_recorded, last_details = self._last_details.get(subject, (None, None))
        if recorded == last_recorded:
            return None
        missing = self._missing_details.get(event.KIND.name, ())
        details = tuple(
            "" if field in missing else replace_times(replace_times_of_day(text, event.time_us))
            for field, text in zip(KEY_FORMS[kind].other_fields, recorded[subject_length:], strict=True)
        )
        self._last_details[subject] = (recorded, details)
        # a run without details has empty texts
        return (
            None
            if details == last_details or not any(details)
            else self._split(kind, (*subject[1:], *details), has_fact_names=True)
        )


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
        has_ended = event.status in SKILL_ENDED and bool(event.skill_string)
        # the first state of the Skiller in the run is the end of a skill of an earlier client
        if old_skill is None and has_ended:
            self._old_skills[skiller] = event.skill_string
            return replace(event, skill_string="", msgid=0, status=SKILL_IDLE)
        if old_skill and has_ended and event.skill_string == old_skill:
            return None
        self._old_skills[skiller] = ""
        return event


def find_missing_details(runs: Sequence[Run]) -> MissingDetails:
    """Return the details that the first event of each kind lacks in at least one run.

    An empty text stands for a detail that a run does not record.
    """
    missing_details: dict[str, frozenset[str]] = {}
    for run in runs:
        for event_type in TYPES_WITH_DETAILS:
            event = next(run.select(event_type), None)
            if event is not None:
                kind = event.KIND
                empty_names = {name for name in kind.detail_fields if not getattr(event, name)}
                missing_details[kind.name] = missing_details.get(kind.name, frozenset()) | empty_names
    return missing_details


def describe_subject(event: Event) -> str:
    """Return a text that names the goal, plan, Skiller, interface, rules or facts of an event."""
    return KEY_FORMS[event.KIND.name].subject_format.format(event)


def describe_changes(a: NamedKey, b: NamedKey) -> str:
    """Return a phrase for the differing fields of two keys of a kind, such as ``another state``.

    With more than :data:`MAX_NAMED_CHANGES` differing fields, the phrase is ``another event``.
    """
    form = KEY_FORMS[a[0][0]]
    parts = zip(form.thread + form.other_fields, _parts_with_names(*a), _parts_with_names(*b), strict=True)
    nouns = [_NOUNS.get(field, field) for field, part_a, part_b in parts if part_a != part_b]
    return f"another {' and '.join(nouns)}" if len(nouns) <= MAX_NAMED_CHANGES else "another event"


def _parts_with_names(key: Key, names: Names) -> Iterator[tuple[str, Names]]:
    """Yield each part of a key after the kind, with the names for its placeholders."""
    index = 0
    for part in key[1:]:
        count = len(PLACEHOLDER.findall(part))
        yield part, names[index : index + count]
        index += count
