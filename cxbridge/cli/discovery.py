"""The table of commands: modules of a package and rows of plug-ins, imported when they are used."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from types import ModuleType
from typing import Any, Final

import typer
from msgspec.structs import replace
from typer.core import TyperGroup

import cxbridge.cli.commands
from cxbridge.cli.styling import StyledCommand, style
from cxbridge.plugins import Row, Table, is_module, rows_of_modules

COMMANDS: Final[Table[Any]] = Table(
    "COMMANDS",
    lambda loaded: callable(loaded) or is_module(loaded) or isinstance(loaded, typer.Typer),
    "a function, a typer.Typer, or a module of either",
    *rows_of_modules(cxbridge.cli.commands),
)
"""The commands of ``cxbridge``; a plug-in's row ``trace report`` is a command of the group ``trace``."""


def top_rows() -> list[Row]:
    """Return the top-level commands and groups."""
    return [row for row in COMMANDS.rows if " " not in row.name]


def rows_of_group(group: str, package: ModuleType | None = None) -> list[Row]:
    """Return the commands of a group: modules of its package, and rows of plug-ins."""
    prefix = f"{group} "
    rows = [row for row in COMMANDS.rows if row.name.startswith(prefix)]
    own = () if package is None else rows_of_modules(package)
    return [*own, *(replace(row, name=row.name.removeprefix(prefix)) for row in rows)]


class CommandModules(MutableMapping[str, Any]):
    """The commands of a table by name, imported when they are used.

    :param rows: the commands; an object is a function, a group, or a module with either.
    :param order: the names that come first.
    :param commands: further existing commands.
    """

    def __init__(self, rows: Sequence[Row], order: Sequence[str], commands: MutableMapping[str, Any]) -> None:
        self._made = dict(commands)
        self._rows = {row.name: row for row in rows}
        self._names = [name for name in order if name in self._rows]
        self._names += sorted(self._rows.keys() - {*self._names})

    def __getitem__(self, name: str) -> Any:
        """Return a command, importing its module."""
        if name not in self._made:
            if name not in self._names:
                raise KeyError(name)
            self._made[name] = self._load(name)
        return self._made[name]

    def _load(self, name: str) -> Any:
        loaded = COMMANDS.load(self._rows[name])
        if isinstance(loaded, ModuleType):
            loaded = getattr(loaded, "app", None) or getattr(loaded, name.replace("-", "_"))
        # typer then treats a function as in its other groups
        parent = typer.Typer(add_completion=False, rich_markup_mode=None)
        if isinstance(loaded, typer.Typer):
            parent.add_typer(loaded, name=name)
        else:
            parent.command(name, cls=StyledCommand)(loaded)
        return style(typer.main.get_group(parent).commands[name])

    def __setitem__(self, name: str, command: Any) -> None:
        self._made[name] = command

    def __delitem__(self, name: str) -> None:
        if name in self._names:
            self._names.remove(name)
        self._made.pop(name, None)

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names in the order of the help, without imports."""
        yield from self._names
        yield from (name for name in self._made if name not in self._names)

    def __len__(self) -> int:
        """Return the number of commands."""
        return sum(1 for _ in self)


def in_sections(rows: Sequence[Row], sections: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Return the names of commands by heading of the help, those without heading last.

    :param sections: names by heading, in order; rows of the table may name further headings.
    """
    known = {row.name for row in rows}
    found = {title: [name for name in names if name in known] for title, names in sections.items()}
    placed = {name for names in found.values() for name in names}
    for row in sorted(rows, key=lambda row: row.name):
        if row.name not in placed:
            found.setdefault(row.section or "Others", []).append(row.name)
    return found


def group_of_commands(
    rows: Callable[[], Sequence[Row]], sections: Mapping[str, Sequence[str]]
) -> type[TyperGroup]:
    """Return the class of a group with the commands of a table.

    :param rows: returns the table's rows.
    :param sections: the names of commands by heading of the help, in order;
        :attr:`~cxbridge.plugins.Row.section` adds further ones.
    """

    # No inner interface of typer: ``cls`` of an app and ``commands`` of a group, which is any mapping, are
    # public parameters, and ``format_commands`` is of the interface that click documents for groups. Typer
    # itself has sections only in help that rich draws.
    class CommandGroup(TyperGroup):
        def __init__(self, *, commands: Any = None, **attributes: Any) -> None:
            table = rows()
            self._sections = in_sections(table, sections)
            order = [name for names in self._sections.values() for name in names]
            lazy: Any = CommandModules(table, order, commands or {})
            super().__init__(commands=lazy, **attributes)

        def format_commands(self, ctx: Any, formatter: Any) -> None:
            """Write the commands by section."""
            if not sections:
                super().format_commands(ctx, formatter)
                return
            width = max(map(len, self.commands))
            for title, names in self._sections.items():
                if names:
                    with formatter.section(title):
                        texts = (
                            self.commands[name].get_short_help_str(formatter.width - width - 4)
                            for name in names
                        )
                        formatter.write_dl(
                            [(name.ljust(width), text) for name, text in zip(names, texts, strict=True)]
                        )

    return CommandGroup
