"""Explains why the rules that could make the next step of a goal do not fire.

A rule may lack a fact that another rule makes: the explanation follows that rule too.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, read_nodes
from cxbridge.errors import CxbridgeError
from cxbridge_studio.agent.condition import find_patterns, parse_condition, split_rule
from cxbridge_studio.explain.cause import RULE_ROOT, Cause
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.rules.report import RuleStory, explain_rule, find_shortage, make_headline

_MAX_RULES: Final = 8  # limit of the explained rules in a story: each takes a process


class WaitingRules:
    """Explains rules of one moment, each once.

    :param outcomes: the outcome of each ended goal, in words, by id.
    """

    def __init__(self, evidence: Evidence, outcomes: Mapping[str, str]) -> None:
        self._evidence = evidence
        self._outcomes = outcomes
        self._causes: dict[str, Cause | None] = {}

    def explain(self, rule: str) -> Cause | None:
        """Return why a rule does not fire; None if its matches are unknown, or it could fire.

        A later call for the same rule returns the reason without the deeper reasons. After :data:`_MAX_RULES`
        explained rules, each further rule gives None.
        """
        if rule in self._causes or len(self._causes) >= _MAX_RULES:
            return replace(cause, because=()) if (cause := self._causes.get(rule)) else None
        self._causes[rule] = None  # ends the recursion if rules make facts for one another
        with suppress(CxbridgeError):
            notes = [*self._evidence.notes]
            story = explain_rule(self._evidence, rule)
            self._evidence.notes[:] = notes  # the notes about a rule's facts belong to the rule's report
            if story.diagnosis is not None and story.diagnosis.failure is not None:
                ended_goal_causes = (
                    Cause(f"{miss.fact}: {self._outcomes[word]}")
                    for miss in story.diagnosis.failure.near
                    for word in re.findall(r"[^\s()]+", miss.fact)
                    if word in self._outcomes
                )
                because = (*self._explain_makers(story), *ended_goal_causes)
                self._causes[rule] = Cause(make_headline(story), because, RULE_ROOT)
        return self._causes[rule]

    def _explain_makers(self, story: RuleStory) -> Iterator[Cause]:
        """Yield why the rules that would make the missing fact of a rule do not fire.

        If no other rule makes such a fact, this is the first cause.
        """
        if (shortage := find_shortage(story)) is None:
            return
        template, slot, values = shortage
        makers = find_setting_rules(self._evidence.read_rule_texts(), template, slot, values)
        if not set(makers) - {story.rule}:
            subject = f"no {'other ' if makers else ''}rule sets the slot {slot} of {template}"
            # The actions of the functions that a rule calls are not read.
            yield Cause(f"{subject} to {' or '.join(values)} in its own actions", root=RULE_ROOT)
        yield from filter(None, map(self.explain, makers))


def find_setting_rules(
    texts: Mapping[str, str], template: str, slot: str, values: Collection[str]
) -> list[str]:
    """Return the rules that set a slot of a template to one of the values, or else to an unknown value.

    :param texts: the defrules by name.
    """
    values_by_rule = {
        name: [*_find_set_values(read_nodes(text)[0], template, slot)]
        for name, text in texts.items()
        # Parsing is slow, and an agent has hundreds of rules: the search for words comes first.
        if template in text and f"({slot} " in text
    }
    return [name for name, set_values in values_by_rule.items() if not {*values}.isdisjoint(set_values)] or [
        name
        for name, set_values in values_by_rule.items()
        # The value of a variable or of a call is unknown.
        if any(value.startswith(("?", "$?", "(")) for value in set_values)
    ]


def _find_set_values(rule: SyntaxNode, template: str, slot: str) -> Iterator[str]:
    """Yield the texts of the values that a rule's own actions give to a slot of a template's facts."""
    variables_of_other_templates = {
        f"?{pattern.variable}"
        for pattern in find_patterns(parse_condition(rule))
        if pattern.template != template
    }
    for node in (node for action in split_rule(rule)[1] for node in action.walk()):
        # `(modify FACT (SLOT VALUE))` and `(TEMPLATE (SLOT VALUE))`; a fact that is not from the condition,
        # e.g. of a query, may be of the template.
        if (
            node.arguments[:1] and node.arguments[0].text not in variables_of_other_templates
            if node.head in ("modify", "duplicate")
            else node.head == template
        ):
            yield from (
                value.text
                for slot_node in node.arguments
                if slot_node.head == slot
                for value in slot_node.arguments
            )
