"""The layout of the monitor's screen: panes, columns, style and key bindings."""

from __future__ import annotations

from typing import ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Static

from cxbridge_studio.monitor.keys import KEYS, SCRUBBING_KEYS

# below this number of columns, the goals are above the panes; chosen freely
NARROW_COLUMNS: Final = 118

# the titles of the columns, by pane; those of the pane `interfaces` depend on the source
COLUMNS: Final = {
    "actions": ("goal", "id", "action", "arguments", "state"),
    "skills": ("skiller", "skill", "status"),
    "facts": ("fact", "text"),
    "agenda": ("salience", "rule", "facts"),
    "breakpoints": ("number", "stops at"),
    "events": ("s", "kind", "description"),
}
# how to make a breakpoint from a row, by pane: its kind, the column of the name, and the text after the name
BREAKPOINT_SPECS: Final = {
    "actions": ("action", 2, ":"),
    "skills": ("skill", 1, ":"),
    "agenda": ("rule", 1, ""),
}
LIVE_PANES: Final = ("story", "actions", "skills", "interfaces", "facts", "agenda", "breakpoints", "log")
RECORDED_PANES: Final = ("story", "actions", "skills", "interfaces", "facts", "events", "log")
# the titles of the panes whose capitalised names are not their titles
PANE_TITLES: Final = {"interfaces": "Blackboard", "breakpoints": "Breaks"}

STYLE: Final = """
#status { height: 1; background: $primary; color: $text; padding: 0 1; }
#message { height: 1; padding: 0 1; text-style: bold; }
#main { layout: horizontal; }
#left { width: 46%; border-right: solid $primary; }
#goals { height: 1fr; overflow-x: hidden; }
#panes { width: 1fr; }
#legend { height: auto; max-height: 2; padding: 0 1; color: $text-muted; }
#prompt { display: none; }
#prompt.shown { display: block; }
.note { height: auto; max-height: 6; padding: 0 1; color: $text-muted; }
#story { height: 1fr; padding: 0 1; }
#story-text { height: auto; }
#fields { border-top: solid $primary; }
TabPane { padding: 0; }
Tab { padding: 0 1 0 0; }
RowTable { height: 1fr; overflow-x: hidden; }
.narrow #main { layout: vertical; }
.narrow #left { width: 100%; height: 35%; border-right: none; border-bottom: solid $primary; }
.narrow #goals { overflow-x: hidden; }
.narrow TabbedContent { height: 1fr; }
HelpScreen { align: center middle; }
#help { width: 76; max-width: 100%; height: auto; max-height: 100%; }
#help { overflow-y: auto; background: $panel; padding: 0 2; }
"""


class HelpScreen(ModalScreen[None]):
    """A modal screen with the list of keys."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(key, "app.pop_screen", show=False) for key in ("escape", "question_mark", "q", "enter")
    ]

    def __init__(self, text: str) -> None:
        super().__init__()
        self._text = text

    def compose(self) -> ComposeResult:
        with Vertical(id="help"):
            yield Static(self._text, markup=False)


def make_key_bindings(source: str) -> list[BindingType]:
    """Return the key bindings for a kind of source.

    :param source: ``live`` or ``recorded``.
    """
    return [
        Binding(
            binding.keys,
            binding.action,
            binding.label or binding.description,
            show=bool(binding.label),
            key_display=binding.display if binding.label else None,
            # with priority, since tables and trees would handle the arrow keys first
            priority=not SCRUBBING_KEYS.isdisjoint(binding.keys.split(",")),
        )
        for binding in KEYS
        if binding.source in {source, "both"}
    ]
