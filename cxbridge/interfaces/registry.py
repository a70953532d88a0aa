"""Registry of interface definitions by type name."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from cxbridge.errors import InterfaceError
from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.names import interface_type_name
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.interfaces.xml.parser import make_name_error, parse_file
from cxbridge.resources import shipped_dir
from cxbridge.suggestions import did_you_mean


class InterfaceRegistry:
    """The interface types of some folders, read on first use. Thread-safe.

    :param dirs: folders with files ``<Type>.xml``; earlier folders take precedence.
    :param shipped: whether to search the definitions of cxbridge after the folders.
    """

    def __init__(self, dirs: Iterable[str | Path] = (), *, shipped: bool = True) -> None:
        searched_dirs = [*map(Path, dirs), *([shipped_dir("interfaces")] if shipped else [])]
        # errors about an absent type name each folder once
        self._dirs = [
            folder
            for index, folder in enumerate(searched_dirs)
            if folder.resolve() not in map(Path.resolve, searched_dirs[:index])
        ]
        self._schemas: dict[str, InterfaceSchema] = {}
        self._classes: dict[str, type[Interface]] = {}
        self._lock = threading.RLock()  # re-entrant: `get` calls `schema`

    @property
    def dirs(self) -> tuple[Path, ...]:
        """The folders in search order."""
        return tuple(self._dirs)

    def names(self) -> list[str]:
        """Return the sorted names of all types that have a file."""
        files = (path for folder in self._dirs if folder.is_dir() for path in folder.glob("*.xml"))
        return sorted({path.stem for path in files})

    def path(self, name: str) -> Path | None:
        """Return the definition file of a type; None if no folder has the file."""
        if not name.isidentifier():  # a name from the network may be '../secret'
            return None
        return next((path for folder in self._dirs if (path := folder / f"{name}.xml").is_file()), None)

    def schema(self, name: str) -> InterfaceSchema:
        """Return the schema of a type.

        :raises InterfaceError: if no folder has the type.
        :raises InterfaceDefinitionError: if its file is invalid.
        """
        with self._lock:
            schema = self._schemas.get(name)
            if schema is None:
                schema = self._schemas[name] = self._parse_definition(name)
            return schema

    def get(self, name: str) -> type[Interface]:
        """Return the class of a type, the same class at each call until :meth:`add` replaces it.

        :raises InterfaceError: if no folder has the type.
        :raises InterfaceDefinitionError: if its file is invalid.
        """
        interface_class = self._classes.get(name)
        if interface_class is None:
            with self._lock:
                interface_class = self._classes.get(name) or make_interface_class(self.schema(name))
                self._classes[name] = interface_class
        return interface_class

    def add(self, interface_class: type[Interface]) -> None:
        """Add a class, for example of a compiled module; the class takes precedence over files."""
        schema: InterfaceSchema = interface_class.SCHEMA
        with self._lock:
            self._schemas[schema.name] = schema
            self._classes[schema.name] = interface_class

    def _parse_definition(self, name: str) -> InterfaceSchema:
        """Read the file of a type."""
        path = self.path(name)
        if path is None:
            raise self._make_not_found_error(name)
        schema = parse_file(path)
        if schema.name != name:
            raise make_name_error(schema, path)
        return schema

    def _make_not_found_error(self, name: str) -> InterfaceError:
        """Return the error for an undefined type, which begins with the words of Fawkes."""
        dirs_text = ", ".join(str(folder) for folder in self._dirs) or "no folder"
        # a user may omit the suffix of the type
        full_name_hint = did_you_mean(interface_type_name(name), self.names(), "check the type's name")
        return InterfaceError(
            f"Interface of type '{name}' not found. Looked for {name}.xml in {dirs_text}.",
            hint=f"{did_you_mean(name, self.names(), full_name_hint)}; "
            "if the daemon has the type, this program needs its folder, too: --interface-dir DIR",
        )


@cache
def default_registry() -> InterfaceRegistry:
    """Return the registry of the shipped definitions."""
    return InterfaceRegistry()
