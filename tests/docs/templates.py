"""The templates of the core as a table of the manual: docs/tutorial-pddl.md.

``python -m tests.docs.templates`` writes the table into the page.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import clips

from tests.support import ROOT

PAGE = ROOT / "docs" / "tutorial-pddl.md"
CORE = ROOT / "cxbridge" / "executive" / "clips" / "cx"
TEMPLATES = ("goal", "plan", "plan-action", "domain-object", "domain-fact", "wm-fact")
TABLE = re.compile(
    r"(?<=<!-- templates: python -m tests.docs.templates -->\n).*?(?=<!-- /templates -->)", re.DOTALL
)


def sources() -> dict[str, str]:
    """Return the text of each deftemplate of the core."""
    found = {}
    for file in sorted(CORE.rglob("*.clp")):
        for part in re.split(r"^(?=\()", file.read_text(), flags=re.MULTILINE):
            if match := re.match(r"\(deftemplate (\S+)", part):
                found[match[1]] = part
    return found


def rows() -> Iterator[str]:
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
    types = [each.lower() for each in slot.types]
    kind = "" if len(types) > len(("float", "integer", "symbol")) else " or ".join(types)
    if slot.multifield:
        return f"any number of {f'{kind}s' if kind else 'values'}"
    return kind or "any value"


def _default(slot: clips.TemplateSlot) -> str:
    if slot.default_type == clips.TemplateSlotDefaultType.NO_DEFAULT:
        return "required"
    default = slot.default_value
    if isinstance(default, tuple):
        return " ".join(f"`{each}`" for each in default)
    return f'`"{default}"`' if type(default) is str else f"`{default}`"


def write(page: Path) -> None:
    """Replace the table of a page."""
    text = page.read_text()
    page.write_text(TABLE.sub(lambda _: "\n".join(rows()) + "\n\n", text))


if __name__ == "__main__":
    write(PAGE)
