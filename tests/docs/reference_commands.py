"""The commands and their options, as the program's help has them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from typing import Any, NamedTuple

import typer

from cxbridge.cli.main import app

TREE: Any = typer.main.get_command(app)
COMMON = 5
"""An option of at least this many commands is described once."""


class Option(NamedTuple):
    """An option of a command, without its default."""

    names: tuple[str, ...]
    metavar: str
    help: str

    def __str__(self) -> str:
        """Return the names, the argument and the description as cells of a table."""
        names = ", ".join(self.names)
        return f"| `{_cell(f'{names} {self.metavar}'.strip())}` | {_prose(self.help)} |"


def lines() -> Iterator[str]:
    """Yield a section for each command, with a table of the options."""
    commands = list(_commands(TREE, ()))
    counts = Counter(option for _, command in commands for option, _ in _options(command))
    most = {option.names: option for option, _ in reversed(counts.most_common())}
    common = {option for option in most.values() if counts[option] >= COMMON}
    of_run = {option for option, _ in _options(TREE.commands["run"])}
    yield from ("### Common options", "", "| option | meaning |", "| --- | --- |")
    yield from sorted(str(option) for option in common - of_run)
    for path, command in commands:
        own = [(option, default) for option, default in _options(command) if option not in common - of_run]
        as_run = [option for option, _ in own if path != ("run",) and option in of_run]
        yield from _section(path, command, [row for row in own if row[0] not in as_run], as_run)


def _commands(command: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield each command with its path: ``run`` first, then by name."""
    names = sorted(getattr(command, "commands", {}), key=lambda name: (name != "run", name))
    for name in names:
        child = command.commands[name]
        if not getattr(child, "commands", {}):
            yield (*path, name), child
        yield from _commands(child, (*path, name))


def _options(command: Any) -> Iterator[tuple[Option, Any]]:
    for item in command.params:
        if item.param_type_name == "option" and "--help" not in item.opts:
            names = (*item.opts, *item.secondary_opts)
            yield Option(names, item.metavar or "", item.help or ""), item.default


def _section(
    path: tuple[str, ...], command: Any, own: list[tuple[Option, Any]], as_run: list[Option]
) -> Iterator[str]:
    arguments = [
        item.metavar or item.name.upper() for item in command.params if item.param_type_name == "argument"
    ]
    yield from ("", f"### {' '.join(path)}", "")
    yield from (
        "`" + " ".join(["cxbridge", *path, *arguments]) + (" [OPTIONS]`" if own or as_run else "`"),
        "",
    )
    yield from _paragraphs(command.help or "")
    if own:
        yield from ("", "| option | meaning | default |", "| --- | --- | --- |")
        yield from (f"{option} {_default(default)} |" for option, default in own)
    if as_run:
        names = ", ".join(f"`{_cell('/'.join(option.names))}`" for option in as_run)
        yield from ("", f"As of [run](#run): {names}.")


def _paragraphs(text: str) -> Iterator[str]:
    for number, paragraph in enumerate(text.strip().split("\n\n")):
        yield from ([""] if number else [])
        yield _prose(" ".join(paragraph.split()), table=False)


def _default(value: Any) -> str:
    if value is None or value is False or value == "" or callable(value):
        return ""
    if isinstance(value, float):
        value = f"{value:g}"
    return "on" if value is True else f"`{_cell(str(value))}`"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _prose(text: str, *, table: bool = True) -> str:
    """Return a text of the help as Markdown: pages are links, nothing else is marked up."""
    text = re.sub(r"([*<\[_])", r"\\\1", _cell(text) if table else text)
    return re.sub(r"docs/([\w-]+)\.md(#[\w-]+)?", r"[\1](\1.md\2)", text)
