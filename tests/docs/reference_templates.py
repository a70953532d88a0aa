"""The templates of the core as tables."""

from __future__ import annotations

import re
from collections.abc import Iterator

import clips

from tests.support import ROOT

CORE = ROOT / "cxbridge" / "executive" / "clips" / "cx"
TEMPLATES = ("goal", "plan", "plan-action", "domain-object", "domain-fact", "wm-fact")


def sources() -> dict[str, str]:
    """Return the text of each deftemplate of the core."""
    found = {}
    for file in sorted(CORE.rglob("*.clp")):
        for part in re.split(r"^(?=\()", file.read_text(), flags=re.MULTILINE):
            if match := re.match(r"\(deftemplate (\S+)", part):
                found[match[1]] = part
    return found


def lines() -> Iterator[str]:
    """Yield the lines of the tables, one table for each template."""
    texts = sources()
    env = clips.Environment()
    for name in TEMPLATES:
        env.build(texts[name])
        purpose = re.search(r'"([^"]*)"', texts[name])
        assert purpose is not None, name
        yield from ("", f"**`{name}`**: {' '.join(purpose[1].split())}", "")
        yield from ("| slot | values | default |", "| --- | --- | --- |")
        for slot in env.find_template(name).slots:
            yield f"| `{slot.name}` | {_values(slot)} | {_default(slot)} |"


def _values(slot: clips.TemplateSlot) -> str:
    allowed = slot.allowed_values  # the symbol FALSE without allowed values
    if isinstance(allowed, tuple):
        return ", ".join(map(str, allowed))
    types = [slot_type.lower() for slot_type in slot.types]
    kind = "" if len(types) > len(("float", "integer", "symbol")) else " or ".join(types)
    if slot.multifield:
        return f"any number of {f'{kind}s' if kind else 'values'}"
    return kind or "any value"


def _default(slot: clips.TemplateSlot) -> str:
    if slot.default_type == clips.TemplateSlotDefaultType.NO_DEFAULT:
        return "required"
    default = slot.default_value
    if isinstance(default, tuple):
        return " ".join(f"`{value}`" for value in default)
    return f'`"{default}"`' if type(default) is str else f"`{default}`"
