"""Finds commands as modules of a package, and imports each one when somebody uses it."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperGroup

from cxbridge.cli.styling import StyledCommand, style


class CommandModules(MutableMapping[str, Any]):
    """The commands that the modules of a package define, by name.

    The names come from the files. A module is imported by the first look at its command, so that one command
    does not wait for the imports of all others.

    :param package: whose modules they are. ``HELP_ORDER`` in it says which names come first.
    :param commands: further commands, made already.
    """

    def __init__(self, package: str, commands: MutableMapping[str, Any]) -> None:
        self._package = package
        self._made = dict(commands)
        folder = import_module(package)
        found = {module.name.replace("_", "-") for module in pkgutil.iter_modules(folder.__path__)}
        self._names = [name for name in folder.HELP_ORDER if name in found]
        self._names += sorted(found - {*self._names})

    def __getitem__(self, name: str) -> Any:
        """Return the command of this name; imports its module."""
        if name not in self._made:
            if name not in self._names:
                raise KeyError(name)
            self._made[name] = self._load(name)
        return self._made[name]

    def _load(self, name: str) -> Any:
        identifier = name.replace("-", "_")
        module = import_module(f"{self._package}.{identifier}")
        # a group of its own makes of a function what typer makes of it anywhere else
        parent = typer.Typer(add_completion=False, rich_markup_mode=None)
        if hasattr(module, "app"):
            parent.add_typer(module.app, name=name)
        else:
            parent.command(name, cls=StyledCommand)(getattr(module, identifier))
        return style(typer.main.get_group(parent).commands[name])

    def __setitem__(self, name: str, command: Any) -> None:
        """Add a command."""
        self._made[name] = command

    def __delitem__(self, name: str) -> None:
        """Remove a command."""
        if name in self._names:
            self._names.remove(name)
        self._made.pop(name, None)

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names, in the order of the help; imports nothing."""
        yield from self._names
        yield from (name for name in self._made if name not in self._names)

    def __len__(self) -> int:
        """Return how many commands there are."""
        return sum(1 for _ in self)


def group_of_modules(package: str) -> type[TyperGroup]:
    """Return the class of a group whose commands are the modules of a package."""

    class ModuleGroup(TyperGroup):
        def __init__(self, *, commands: Any = None, **attributes: Any) -> None:
            super().__init__(**attributes)
            self.commands = CommandModules(package, commands or {})

        def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002 - click's signature
            """Write the list of commands, in sections if the package has some."""
            sections: Mapping[str, Sequence[str]] = getattr(import_module(package), "HELP_SECTIONS", {})
            named = {name for names in sections.values() for name in names}
            others = {
                "Others" if sections else "Commands": [name for name in self.commands if name not in named]
            }
            width = max(map(len, self.commands))
            for title, names in {**sections, **others}.items():
                found = [name for name in names if name in self.commands]
                if found:
                    with formatter.section(title):
                        texts = (
                            self.commands[name].get_short_help_str(formatter.width - width - 4)
                            for name in found
                        )
                        formatter.write_dl(
                            [(name.ljust(width), text) for name, text in zip(found, texts, strict=True)]
                        )

    return ModuleGroup
