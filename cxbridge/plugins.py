"""Plug-ins, and the tables to which they add rows; writing plug-ins: docs/plugins.md."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules, resolve_name
from types import MappingProxyType, ModuleType
from typing import Any, Final, Generic, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from cxbridge.errors import CxbridgeError
from cxbridge.extras import missing_package_error, plugin_command
from cxbridge.suggestions import did_you_mean

API: Final = 1
"""The version of the hooks; plug-ins for other versions are refused."""

GROUP: Final = "cxbridge"
"""The group of entry points of plug-ins, named like the package; each names a module with tables."""

HOOKS: Final = frozenset(
    {
        "CHECKS",
        "CLOCKS",
        "COMMANDS",
        "COMPONENTS",
        "DECIDERS",
        "EXPLAINERS",
        "FEATURES",
        "FORMATS",
        "MEMBERS",
        "OPERATIONS",
        "OPTIONS",
        "SETTINGS",
        "SOURCES",
        "TEMPLATES",
        "TRANSPORTS",
        "VIEWS",
    }
)
"""The tables of cxbridge to which plug-ins may add rows."""

# The constant of a plug-in's module that names the plug-in's own tables, to which other plug-ins may add
# rows.
_OWN_HOOKS: Final = "HOOKS"

# Upper-case names of a plug-in's module that are not tables.
_OTHER_CONSTANTS: Final = frozenset({"API", _OWN_HOOKS})

# The heading of a group in entry_points.txt, e.g. [cxbridge].
_GROUP_HEADING: Final = re.compile(r"\[([^\]\n]+)\]")

T = TypeVar("T")


class PluginError(CxbridgeError):
    """A plug-in, or an object of its tables, is missing or cannot be used."""


def always(_context: Any) -> bool:
    """Return True, for objects that every run needs."""
    return True


def never(_context: Any) -> bool:
    """Return False, for objects that are only made on request."""
    return False


def in_daemon(section: str) -> Callable[[Any], bool]:
    """Return a predicate: whether the context is a daemon whose configuration has a plug-in's settings.

    :param section: the name of the settings' row in ``SETTINGS``.
    """
    return lambda context: context.section(section) is not None


def configured(*sections: str) -> Callable[[Any], bool]:
    """Return a predicate: whether the configuration of a run has one of these sections.

    :param sections: paths such as ``/ros2/performers``.
    """
    return lambda context: any(context.config.keys(section) for section in sections)


class Row(Struct, frozen=True):
    """A row of a table: a named object, imported when it is needed.

    :param target: ``module:object``.
    :param needed: returns whether the run or daemon with this context needs the object.
    :param early: for features: returns whether the run makes the feature at its start instead of on request,
        so that mistakes in the feature's configuration are reported before a rule fires. For components:
        returns whether the component starts before the components of cxbridge, to observe them.
    :param requested: for features: returns whether the run requests the feature for an agent that does not.
    :param in_replays: for components: whether a replay makes the component. A replay leaves out all other
        components except the executive: the recording has their writes.
    :param section: for top-level commands: the heading in the help.
    :param origin: the plug-in with the row and its package, empty for cxbridge; set when the plug-in is read.
    """

    name: str
    target: str
    needed: Callable[[Any], bool] = always
    early: Callable[[Any], bool] = never
    requested: Callable[[Any], bool] = never
    in_replays: bool = False
    section: str = ""
    origin: str = ""

    def __str__(self) -> str:
        return f"{self.target} of {self.origin or 'cxbridge'}"


def make_module_rows(package: ModuleType) -> tuple[Row, ...]:
    """Return a row per module of a package, sorted by name, so that a new file is a new row."""
    names = sorted(module.name for module in iter_modules(package.__path__))
    return tuple(Row(name.replace("_", "-"), f"{package.__name__}.{name}") for name in names)


def is_module(loaded: object) -> bool:
    """Return whether an object is a module, for tables of modules."""
    return isinstance(loaded, ModuleType)


class Plugin(Struct, frozen=True, eq=False):
    """An installed plug-in.

    :param name: the name of the entry point.
    :param package: the distribution and its version, e.g. ``cxbridge-ros2 0.2.0``.
    :param rows: the rows by the name of their table.
    :param error: why the plug-in cannot be used; None for a usable plug-in.
    """

    name: str
    package: str
    rows: Mapping[str, tuple[Row, ...]] = MappingProxyType({})
    error: PluginError | None = None


class Table(Generic[T]):
    """Named objects of one kind: those of cxbridge, then those of plug-ins by name.

    :param hook: the table's name in plug-ins: one of :data:`HOOKS`, or declared by a plug-in.
    :param accepts: returns whether an object has the table's kind.
    :param kind: the description of the kind, for errors.
    :param rows: the rows of cxbridge.
    """

    def __init__(self, hook: str, accepts: Callable[[Any], bool], kind: str, *rows: Row) -> None:
        self.hook, self._kind = hook, kind
        self._accepts, self._own_rows = accepts, rows

    @property
    def rows(self) -> tuple[Row, ...]:
        """The rows; two of cxbridge may share a name if no run needs both.

        :raises PluginError: if a plug-in's row has the name of another row.
        """
        return _merge_rows(self.hook, self._own_rows, installed_plugins())

    def find(self, name: str) -> Row:
        """Return a row by name.

        :raises PluginError: if there is none.
        """
        for row in self.rows:
            if row.name == name:
                return row
        names = [row.name for row in self.rows]
        hint = package_hint(name) or did_you_mean(name, names, f"known: {', '.join(names)}")
        raise PluginError(f"there is no {_row_noun(self.hook)} '{name}'", hint=hint)

    def load_target(self, row: Row) -> T:
        """Import the object of a row.

        :raises PluginError: if the object of a plug-in cannot be imported, or the object has another kind.
        :raises CxbridgeError: if a package is missing that cxbridge or a plug-in requires.
        """
        title = f"the {_row_noun(self.hook)} '{row.name}' ({row})"
        try:
            loaded: T = resolve_name(row.target)
        except Exception as error:
            absence = missing_package_error(error) if isinstance(error, ModuleNotFoundError) else None
            if absence is not None or not row.origin:
                raise absence or error from None  # an error of cxbridge itself is a fault, with its traceback
            raise PluginError(
                f"{title} cannot be loaded: {type(error).__name__}: {error}",
                hint=_make_mend_hint(row.origin),
            ) from error
        if not self._accepts(loaded):
            raise PluginError(f"{title} is not {self._kind}", hint="see docs/plugins.md")
        return loaded


def _make_mend_hint(origin: str) -> str:
    """Return the hint for a plug-in that is installed, but cannot be used."""
    return f"mend or uninstall the package of the plug-in {origin}; docs/plugins.md describes the hooks"


@lru_cache(maxsize=64)  # more than there are tables
def _merge_rows(hook: str, own_rows: tuple[Row, ...], plugins: tuple[Plugin, ...]) -> tuple[Row, ...]:
    """Return the rows of a table.

    :raises PluginError: if a plug-in's row has the name of another row.
    """
    merged = [*own_rows]
    for plugin in plugins:
        for row in plugin.rows.get(hook, ()):
            for earlier_row in merged:
                if earlier_row.name == row.name:
                    raise duplicate_error(hook, earlier_row, row)
            merged.append(row)
    return tuple(merged)


def duplicate_error(hook: str, first: Row, second: Row) -> PluginError:
    """Return the error for two conflicting rows of the same name."""
    noun = _row_noun(hook)
    return PluginError(
        f"two {noun}s are called '{second.name}': {first}, and {second}",
        hint=f"uninstall the package of one {noun}, or rename the {noun}",
    )


def _row_noun(hook: str) -> str:
    """Return the noun for one row of a table, e.g. ``check`` for CHECKS."""
    return hook.lower().removesuffix("s")


@lru_cache(maxsize=1)
def known_packages() -> Mapping[str, str]:
    """Return the known packages of plug-ins by the names of their rows, options, sections and tables."""
    text = Path(__file__).with_name("known_plugins.json").read_text(encoding="utf-8")
    packages: dict[str, str] = json.loads(text)
    return MappingProxyType(packages)


def find_package_of(name: str) -> str:
    """Return the known package with a row, an option or a section; empty if there is none."""
    return known_packages().get(name, "")


def unused_section_warnings(has_section: Callable[[str], object]) -> list[str]:
    """Return a warning for each section of a configuration that belongs to an absent package.

    :param has_section: returns whether the configuration has a section.
    """
    return [
        f"the section {path} of the configuration is not used: {hint}"
        for path in known_packages()
        if path.startswith("/") and has_section(path) and (hint := absent_package_hint(path))
    ]


def is_installed(target: str) -> bool:
    """Return whether ``module:object`` belongs to cxbridge or an installed plug-in."""
    package = target.partition(":")[0].partition(".")[0]
    return package == __package__ or any(
        row.target.partition(":")[0].partition(".")[0] == package
        for plugin in installed_plugins()
        for rows in plugin.rows.values()
        for row in rows
    )


def installed_plugins() -> tuple[Plugin, ...]:
    """Return the plug-ins of the installed packages, sorted by name; an unusable plug-in has an ``error``.

    A running program does not notice a package that is installed later, as Python does not for modules.
    """
    return _read_plugins(tuple(sys.path))


def package_hint(name: str) -> str:
    """Return a hint to install the package with a row, an option or a section; empty if unknown."""
    package = find_package_of(name)
    return f"{name} belongs to the plug-in {package}: {plugin_command(package)}" if package else ""


def absent_package_hint(name: str) -> str:
    """Return the hint of :func:`package_hint`; empty if the package is installed."""
    installed = {plugin.package.partition(" ")[0] for plugin in installed_plugins()}
    return "" if find_package_of(name) in installed else package_hint(name)


# A run asks some 30 times, and the search calls the operating system for each folder. The cache has an entry
# for each value of sys.path, which programs rarely change.
@lru_cache(maxsize=16)
def _read_plugins(search_path: tuple[str, ...]) -> tuple[Plugin, ...]:
    modules_and_packages: dict[str, list[tuple[str, str]]] = {}  # by the name of the plug-in
    for folder, changed_ns in _plugin_folders(search_path):
        for name, module, metadata_folder in _read_entry_points(folder, changed_ns):
            modules_and_packages.setdefault(name, []).append((module, _package_title(metadata_folder)))
    imported = {
        name: _import_module_of(name, modules_and_packages[name]) for name in sorted(modules_and_packages)
    }
    # all modules before the first table, because a plug-in may have rows for the hook of another plug-in
    hooks = HOOKS.union(*(getattr(module, _OWN_HOOKS, ()) for _, module in imported.values()))
    return tuple(_make_plugin(name, package, module, hooks) for name, (package, module) in imported.items())


def _import_module_of(
    name: str, modules_and_packages: list[tuple[str, str]]
) -> tuple[str, ModuleType | PluginError]:
    """Return the package of a plug-in, and the plug-in's module or the error that prevents its use.

    :param modules_and_packages: the module and the package of each entry point with the plug-in's name.
    """
    module, package = modules_and_packages[0]
    # one package may appear in several folders of sys.path
    packages = " and ".join(sorted({package for _, package in modules_and_packages}))
    if packages != package:
        message = f"{packages} both have a plug-in named '{name}'"
        return packages, PluginError(message, hint="uninstall one of them")
    try:
        return package, import_module(module)
    except Exception as error:  # noqa: BLE001 - a plug-in's module may raise anything
        message = f"the plug-in '{name}' of {package} cannot be loaded: {type(error).__name__}: {error}"
        return package, PluginError(message, hint=_make_mend_hint(name))


def _make_plugin(name: str, package: str, module: ModuleType | PluginError, hooks: frozenset[str]) -> Plugin:
    if isinstance(module, PluginError):
        return Plugin(name, package, error=module)
    try:
        return Plugin(name, package, _rows_by_table(name, package, module, hooks))
    except PluginError as error:
        return Plugin(name, package, error=error)


def _rows_by_table(
    name: str, package: str, module: Any, hooks: frozenset[str]
) -> Mapping[str, tuple[Row, ...]]:
    """Return the tables of a plug-in's module.

    :param hooks: the names of all tables.
    :raises PluginError: if the module is for another version of the hooks, or a table is malformed.
    """
    api = getattr(module, "API", None)
    if api != API:
        raise PluginError(
            f"the plug-in '{name}' of {package} is for version {api} of the hooks, "
            f"this cxbridge has version {API}",
            hint=f"install a version of {package.partition(' ')[0]} that fits this cxbridge",
        )
    tables = {
        hook: rows for hook, rows in vars(module).items() if hook.isupper() and hook not in _OTHER_CONSTANTS
    }
    for hook, rows in tables.items():
        if hook.startswith("_"):  # a private constant of the plug-in
            continue
        if hook not in hooks:
            raise PluginError(
                f"the plug-in '{name}' of {package} has a table {hook}, but no hook has that name",
                hint=package_hint(hook)
                or did_you_mean(hook, hooks, f"the hooks: {', '.join(sorted(hooks))}"),
            )
        if not isinstance(rows, tuple) or not all(isinstance(row, Row) for row in rows):
            raise PluginError(
                f"{hook} of the plug-in '{name}' of {package} is not a tuple of rows",
                hint=f"write {hook} = (Row(NAME, 'module:object'),)",
            )
    return MappingProxyType(
        {
            hook: tuple(replace(row, origin=f"{name} ({package})") for row in rows)
            for hook, rows in tables.items()
            if hook in hooks
        }
    )


def _plugin_folders(search_path: Iterable[str]) -> Iterator[tuple[str, int]]:
    """Yield the folders of ``sys.path`` with plug-ins, and their times of change in nanoseconds."""
    for folder in search_path:
        with suppress(OSError):  # sys.path may name absent folders
            changed_ns = os.stat(folder or ".").st_mtime_ns  # noqa: PTH116 - each run pays, and pathlib is slow
            path = os.path.abspath(folder)  # noqa: PTH100 - as above
            if _read_entry_points(path, changed_ns):
                yield path, changed_ns


@lru_cache(maxsize=64)  # more than the folders of a usual sys.path
def _read_entry_points(folder: str, changed_ns: int) -> tuple[tuple[str, str, str], ...]:  # noqa: ARG001
    """Return the entry points of our group in a folder: name, module, folder with metadata.

    ``importlib.metadata`` is slow to import and reads hundreds of files; `os.path` is faster than pathlib. An
    installation changes the folder and thus the cache key.

    :param changed_ns: the time of the folder's last change, only for the cache.
    """
    entry_points: list[tuple[str, str, str]] = []
    # the folder may be unreadable, and most packages have no file with entry points
    with suppress(OSError):
        for name in sorted(os.listdir(folder)):  # noqa: PTH208
            if name.endswith("-info") and "." in name:  # .dist-info or .egg-info
                metadata_folder = os.path.join(folder, name)  # noqa: PTH118
                file = os.path.join(metadata_folder, "entry_points.txt")  # noqa: PTH118
                with suppress(OSError), open(file, encoding="utf-8", errors="replace") as stream:  # noqa: PTH123
                    entry_points += ((*pair, metadata_folder) for pair in _parse_entry_points(stream.read()))
    return tuple(entry_points)


def _parse_entry_points(text: str) -> Iterator[tuple[str, str]]:
    """Yield name and module of each entry point of our group.

    :param text: the content of an ``entry_points.txt``.
    """
    group = ""
    for line in text.splitlines():
        if heading := _GROUP_HEADING.match(line):
            group = heading[1]
        elif group == GROUP and "=" in line and not line.startswith("#"):
            name, _, module = line.partition("=")
            yield name.strip(), module.strip()


def _package_title(metadata_folder: str) -> str:
    """Return name and version of a package, e.g. ``cxbridge-ros2 0.2.0``."""
    for name in ("METADATA", "PKG-INFO"):
        with suppress(OSError):  # a package has one of these files
            head = (
                Path(metadata_folder, name).read_text(encoding="utf-8", errors="replace").partition("\n\n")[0]
            )
            fields = dict(line.partition(": ")[::2] for line in head.splitlines())
            return f"{fields.get('Name', '')} {fields.get('Version', '')}"
    return Path(metadata_folder).stem.replace("-", " ", 1)
