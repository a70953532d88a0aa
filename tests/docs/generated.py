"""The parts of the manual that are made from the code.

``python -m tests.docs.generated`` writes them into their pages, each between two comments with its name.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

from tests.docs import (
    reference_api,
    reference_commands,
    reference_rest,
    reference_tables,
    reference_templates,
)
from tests.support import ROOT

DOCS = ROOT / "docs"
COMMAND = "python -m tests.docs.generated"

PARTS: dict[str, tuple[str, Callable[[], Iterator[str]]]] = {
    "templates": ("tutorial-pddl.md", reference_templates.lines),
    "commands": ("commands.md", reference_commands.lines),
    "events": ("formats.md", reference_tables.events),
    "codes": ("check-codes.md", reference_tables.codes),
    "routes": ("rest.md", reference_rest.routes),
    "models": ("rest.md", reference_rest.models),
    "names": ("api.md", reference_api.lines),
}
"""The page and the lines of each part."""


def pattern(name: str) -> re.Pattern[str]:
    """Return the place of a part in its page."""
    return re.compile(rf"(?<=<!-- {name}: {re.escape(COMMAND)} -->\n).*?(?=<!-- /{name} -->)", re.DOTALL)


def text(name: str) -> str:
    """Return a part as the page has it."""
    return "\n".join(["", *PARTS[name][1](), "", ""])


def write(folder: Path) -> None:
    """Write all parts into the pages of a folder."""
    for name, (page, _) in PARTS.items():
        path = folder / page
        before = path.read_text()
        if found := pattern(name).search(before):
            path.write_text(before[: found.start()] + text(name) + before[found.end() :])


if __name__ == "__main__":
    write(DOCS)
