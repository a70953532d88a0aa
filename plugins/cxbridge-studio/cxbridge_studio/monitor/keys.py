"""The keys of the monitor and their actions."""

from __future__ import annotations

from typing import Final, NamedTuple

from cxbridge.history.outcome import LEGEND


class KeyBinding(NamedTuple):
    """A binding of keys to an action of the screen.

    :param keys: the names of the keys in textual, separated by commas.
    :param action: the action in textual's notation.
    :param label: the label in the last line of the screen; empty to hide the key there.
    :param description: the description in the list of keys; empty if another row describes the key, too.
    :param display: the key as displayed.
    :param source: ``live``, ``recorded`` or ``both``.
    """

    keys: str
    action: str
    label: str
    description: str
    display: str
    source: str = "both"


KEYS: Final = (
    KeyBinding("question_mark", "help", "Keys", "this list", "?"),
    KeyBinding("q", "quit", "Quit", "quit", "q"),
    KeyBinding(
        "slash", "ask('/')", "Filter", "show only goals and rows with a text; Esc shows all again", "/"
    ),
    KeyBinding("colon", "ask(':')", "", "type a command, see below", ":"),
    KeyBinding("escape", "dismiss", "", "close the command line, clear the filter", "Esc"),
    KeyBinding("n", "next_environment", "Env", "facts and agenda of the next CLIPS environment", "n"),
    KeyBinding("p", "do('pause')", "Pause", "pause the active components", "p", "live"),
    KeyBinding("r", "do('resume')", "Resume", "resume, and continue stopped rules", "r", "live"),
    KeyBinding("s", "do('step rule')", "Rule", "step a rule", "s", "live"),
    KeyBinding("l", "do('step loop')", "Loop", "step a loop", "l", "live"),
    KeyBinding("t", "do('step transition')", "Transition", "step a transition", "t", "live"),
    KeyBinding("b", "breakpoint", "Break", "set a breakpoint at the selection", "b", "live"),
    KeyBinding("d", "delete", "", "remove the selected breakpoint", "d", "live"),
    KeyBinding("left", "do('event -1')", "", "one event back, forward", "← →", "recorded"),
    KeyBinding("right", "do('event 1')", "", "", "", "recorded"),
    KeyBinding(
        "shift+left,comma",
        "do('transition -1')",
        "",
        "one transition back, forward (also: , and .)",
        "Shift ← →",
        "recorded",
    ),
    KeyBinding("shift+right,full_stop", "do('transition 1')", "", "", "", "recorded"),
    KeyBinding("home", "do('begin')", "", "to the beginning, to the end", "Home End", "recorded"),
    KeyBinding("end", "do('end')", "", "", "", "recorded"),
    KeyBinding("j", "ask(':jump ')", "Jump", "to a time, in seconds since the beginning", "j", "recorded"),
)

# bindings with one of these keys scrub a recording, whichever widget has the focus, except the prompt
SCRUBBING_KEYS: Final = frozenset({"left", "right", "shift+left", "shift+right", "home", "end"})


def make_help_text(source: str, panes: str, commands: str) -> str:
    """Return the text of the help screen.

    :param source: ``live`` or ``recorded``.
    :param panes: the names of the panes, in the order of their digits.
    :param commands: the list of commands.
    """
    bindings = [binding for binding in KEYS if binding.description and binding.source in {source, "both"}]
    lines = [f"{binding.display:10} {binding.description}" for binding in bindings]
    lines += [
        f"{'1 2 3 ...':10} {panes}",
        f"{'Tab':10} the next part of the screen",
        "",
        f"Goals: {LEGEND}",
        f"Commands: {commands}",
    ]
    return "\n".join(lines)
