"""The kinds of events, and the codes of the check, as tables."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator

from cxbridge.event_kinds import EVENT_TYPES


def events() -> Iterator[str]:
    """Yield a row for each kind of event: its class, its meaning, its fields."""
    yield from ("| kind | event | meaning | fields besides `time_us` |", "| --- | --- | --- | --- |")
    for name, kind in EVENT_TYPES.items():
        meaning = " ".join((inspect.getdoc(kind) or "").partition("\n\n")[0].split())
        fields = ", ".join(f"`{field}`" for field in kind.__struct_fields__ if field != "time_us")
        yield f"| `{name}` | {kind.__name__} | {_plain(meaning)} | {fields} |"


def codes() -> Iterator[str]:
    """Yield a row for each code of the check."""
    from cxbridge_studio.check.table import load_codes as known

    yield from ("| code | severity | finding |", "| --- | --- | --- |")
    for code in known().values():
        anchor = re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", f"{code.name} {code.title}").strip().lower())
        yield f"| [{code.name}](#{anchor}) | {code.severity.value} | {code.title} |"


def _plain(text: str) -> str:
    """Return a docstring without its roles, as a cell."""
    return re.sub(r":\w+:`~?\.?([^`]+)`", r"`\1`", text).replace("``", "`").replace("|", "\\|")
