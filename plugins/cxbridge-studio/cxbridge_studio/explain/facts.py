"""Explains the origin of a fact: the rules that fired just before the fact was asserted, and retracted."""

from __future__ import annotations

from cxbridge.errors import CxbridgeError
from cxbridge.numbers import parse_decimal
from cxbridge_studio.explain.evidence import Evidence
from cxbridge_studio.explain.explanation import Explanation


def explain_fact(evidence: Evidence, name: str) -> Explanation:
    """Explain a fact, named by its index: ``f-12``.

    :raises CxbridgeError: if the name is not an index, or the fact is unknown; if facts are not recorded, the
        hint says how to record them.
    """
    index = parse_decimal(name.removeprefix("f-"))
    if index is None:
        raise CxbridgeError(f"'{name}' is not a fact", hint="name the index of a fact, such as f-12")
    lives = evidence.history.fact_lives
    if not lives:
        raise CxbridgeError(
            f"the origin of f-{index} is unknown: facts are not recorded",
            hint="record with --trace-level facts",
        )
    if (life := lives.get(index)) is None:
        raise CxbridgeError(f"no fact f-{index} is known before this moment")
    changed_text, details = "", [life.text]
    if (previous_life := lives.get(life.replaced_index)) is not None:
        changed_text = f", instead of f-{previous_life.index}"
        details.append(f"instead of f-{previous_life.index} {previous_life.text}")
    begin_s = evidence.compute_seconds(life.begin_us)
    headline = f"f-{index} was asserted at {begin_s:.3f} s{changed_text}: {_describe_firing(life.begin_rule)}"
    details.append(
        "it still exists"
        if life.end_us is None
        else f"it was retracted at {evidence.compute_seconds(life.end_us):.3f} s: "
        f"{_describe_firing(life.end_rule)}"
    )
    return Explanation(
        (headline, f"in {evidence.where}", "", *details),
        # The form is that of the stories of goals, because the page shows both alike.
        {
            "headline": headline,
            "where": evidence.where,
            "cause": {"text": headline, "because": [{"text": text, "because": []} for text in details]},
            "rules": [rule for rule in (life.begin_rule, life.end_rule) if rule],
            "moments": [],
            "notes": evidence.notes,
        },
    )


def _describe_firing(rule: str) -> str:
    """Return the firing just before a change of a fact, as a clause.

    :param rule: the rule that fired; empty if unknown.
    """
    return f"rule {rule} fired just before" if rule else "no rule is known to have fired before"
