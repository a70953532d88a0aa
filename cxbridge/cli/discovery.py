"""The table of commands: modules of a package, and rows of plug-ins.

A command is imported when it is used, because importing all commands takes longer than most commands run.
"""

from __future__ import annotations

from collections import UserDict
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain
from types import ModuleType
from typing import Any, Final

import typer
from msgspec.structs import replace
from typer.core import TyperGroup

import cxbridge.cli.commands
from cxbridge.cli.styling import StyledCommand, style
from cxbridge.plugins import Row, Table, is_module, make_module_rows

COMMANDS: Final[Table[Any]] = Table(
    "COMMANDS",
    lambda loaded: callable(loaded) or is_module(loaded) or isinstance(loaded, typer.Typer),
    "a function, a typer.Typer, or a module of either",
    *make_module_rows(cxbridge.cli.commands),
)
"""The commands of ``cxbridge``; a plug-in's row ``trace report`` is a command of the group ``trace``."""


def top_level_rows() -> list[Row]:
    """Return the rows of the top-level commands and groups."""
    return [row for row in COMMANDS.rows if " " not in row.name]


def group_rows(group: str, package: ModuleType | None = None) -> list[Row]:
    """Return the rows of a group's commands: the modules of its package, and rows of plug-ins.

    :param package: the package; None for a group whose commands are not separate modules.
    """
    prefix = f"{group} "
    module_rows = () if package is None else make_module_rows(package)
    plugin_rows = [row for row in COMMANDS.rows if row.name.startswith(prefix)]
    return [*module_rows, *(replace(row, name=row.name.removeprefix(prefix)) for row in plugin_rows)]


class LazyCommands(UserDict[str, Any]):
    """The commands of a table by name; each value is a row until the command is used, then the command.

    A row names a function, a group, or a module with either.
    """

    def __getitem__(self, name: str) -> Any:
        """Return a command, importing its module on first use."""
        command = self.data[name]
        if isinstance(command, Row):
            command = self.data[name] = _load_command(command)
        return command


def _load_command(row: Row) -> Any:
    """Import the command of a row."""
    name, loaded = row.name, COMMANDS.load_target(row)
    if isinstance(loaded, ModuleType):
        loaded = getattr(loaded, "app", None) or getattr(loaded, name.replace("-", "_"))
    # typer turns a function into a command only within a group
    parent = typer.Typer(add_completion=False, rich_markup_mode=None)
    if isinstance(loaded, typer.Typer):
        parent.add_typer(loaded, name=name)
    else:
        parent.command(name, cls=StyledCommand)(loaded)
    return style(typer.main.get_group(parent).commands[name])


def names_by_section(rows: Iterable[Row], sections: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Return the names of commands by heading of the help; commands without a heading are last.

    :param sections: the names by heading, in order; rows of plug-ins may name further headings.
    """
    # rows that name a heading come first, so that the commands without a heading are last
    sorted_rows = sorted(rows, key=lambda row: (not row.section, row.name))
    row_names = {row.name for row in sorted_rows}
    names_of_sections = {
        title: [name for name in names if name in row_names] for title, names in sections.items()
    }
    for row in sorted_rows:
        if row.name not in chain.from_iterable(sections.values()):
            names_of_sections.setdefault(row.section or "Others", []).append(row.name)
    return names_of_sections


def make_group_class(
    list_rows: Callable[[], Sequence[Row]], sections: Mapping[str, Sequence[str]]
) -> type[TyperGroup]:
    """Return the class of a group with the commands of a table.

    :param list_rows: returns the table's rows; called when the group is made.
    :param sections: the names of commands by heading of the help, in order;
        :attr:`~cxbridge.plugins.Row.section` adds further headings.
    """

    # Only public interfaces: typer documents ``cls`` of an app and ``commands`` of a group, which may be any
    # mapping, and click documents ``format_commands`` for subclasses of groups. Typer itself supports
    # sections only in help that rich draws.
    class CommandGroup(TyperGroup):
        def __init__(self, *, commands: Any = None, **attributes: Any) -> None:
            table_rows = {row.name: row for row in list_rows()}
            self._sections = names_by_section(table_rows.values(), sections)
            ordered_rows = {name: table_rows[name] for name in chain.from_iterable(self._sections.values())}
            lazy_commands: Any = LazyCommands({**ordered_rows, **(commands or {})})
            super().__init__(commands=lazy_commands, **attributes)

        def format_commands(self, ctx: Any, formatter: Any) -> None:
            """Write the commands by section, or in one list if no sections are named."""
            if not sections:
                super().format_commands(ctx, formatter)
                return
            width = max(map(len, self.commands))  # of all sections, so that their help texts are aligned
            for title, names in self._sections.items():
                if names:
                    with formatter.section(title):
                        # 4: two spaces before the names, and two between names and texts
                        help_texts = (
                            self.commands[name].get_short_help_str(formatter.width - width - 4)
                            for name in names
                        )
                        formatter.write_dl(
                            [
                                (name.ljust(width), help_text)
                                for name, help_text in zip(names, help_texts, strict=True)
                            ]
                        )

    return CommandGroup
