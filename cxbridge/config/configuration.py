"""The configuration of a program: typed values by path."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from cxbridge.config.documents import MAX_DEPTH, Mark
from cxbridge.config.loader import ConfigLoader, list_config_files
from cxbridge.config.scalars import to_bool, to_float, to_int, to_uint32
from cxbridge.config.secrets import mask
from cxbridge.config.tree import ConfigNode, ConfigValue, NodeKind, overlay, split_path
from cxbridge.errors import ConfigError
from cxbridge.suggestions import did_you_mean

T = TypeVar("T")
D = TypeVar("D")
Scalar = bool | int | float | str


class _Missing:
    """The type of a missing default: None is a default that callers use."""


_MISSING = _Missing()
_MIN_PATH_SIMILARITY = 0.75  # the minimum similarity for a suggestion; high, because many paths begin equally


class Configuration:
    """Values by path, e.g. ``/fawkes/mainapp/desired_loop_time``.

    Elements of a list of maps have the path elements ``/0/``, ``/1/``, and so on. Leading and double slashes
    are ignored. Getters raise :class:`ConfigError` without a value and without ``default=``, and for a value
    of another type. A map in place of a value is an error even with a default; only an empty map counts as
    null. Changes (:meth:`set`, :meth:`overlay`) are not thread-safe.
    """

    def __init__(self) -> None:
        self._root = ConfigNode(NodeKind.MAP, Mark())
        self.files: tuple[Path, ...] = ()
        """The files in the order in which they are laid over each other."""
        self._host_includes: tuple[Path, ...] = ()  # the files of other hosts, for hints
        self.warnings: tuple[str, ...] = ()
        """Probable mistakes that are not errors, such as duplicate keys, with file and line."""

    @classmethod
    def load(
        cls, path: str | Path, *, host: str | None = None, confdir: str | Path | None = None
    ) -> Configuration:
        """Read a configuration file with its includes.

        Of a folder, read ``config.yaml`` with its includes; without this file, read all files of the folder.

        :param host: the text for ``$host`` in includes; by default the name of the machine.
        :param confdir: the base folder of relative includes; by default the file's folder.
        :raises ConfigError: if a file cannot be read, or a value is invalid.
        """
        path = Path(path)
        main_file = path / "config.yaml" if path.is_dir() else path
        is_whole_folder = main_file is not path and not main_file.is_file()
        try:
            files = list_config_files(path) if is_whole_folder else [main_file]
        except OSError as error:
            raise ConfigError(f"cannot read the folder: {error.strerror}", file=path) from None
        if not files:
            raise ConfigError("the folder has no configuration file (*.yaml)", file=path)
        loader = ConfigLoader(Path(confdir or files[0].parent), host)
        loader.load_files(files)
        return cls._from_loader(loader)

    @classmethod
    def from_text(
        cls, text: str, name: str = "<text>", *, host: str | None = None, confdir: str | Path = "."
    ) -> Configuration:
        """Read a configuration from a text; ``name`` replaces the file in errors."""
        loader = ConfigLoader(Path(confdir), host)
        loader.load_text(text, name)
        return cls._from_loader(loader)

    @classmethod
    def _from_loader(cls, loader: ConfigLoader) -> Configuration:
        config = cls()
        config._root = loader.root
        config.files = tuple(loader.files)
        config.warnings = tuple(loader.warnings)
        config._host_includes = tuple(loader.host_includes)
        return config

    def get_file(self, path: str) -> Path | None:
        """Return the file that a value names, or None for an empty or missing value.

        A relative name is resolved in the folder of the configuration file with the value, so that an overlay
        of a shipped scenario can keep its files in its folder. A value that was set at run time is resolved
        in the working directory.

        :raises ConfigError: if the value has another type.
        """
        name = self.get_str(path, default="")
        return Path(self.get(path).file).parent / name if name else None

    def exists(self, path: str) -> bool:
        """Return whether there is a value at a path: a scalar, a list of scalars, null or an empty map."""
        node = self._root.find(path)
        return node is not None and not node.children

    def is_list(self, path: str) -> bool:
        """Return whether a value is a list of scalars.

        :raises ConfigError: if there is no value.
        """
        return self.get(path).is_list

    def get(self, path: str) -> ConfigValue:
        """Return a value.

        :raises ConfigError: if there is none, with similar paths.
        """
        node = self._root.find(path)
        if node is None or node.children:
            raise self._make_missing_error(path, node)
        return _make_value(path, node)

    def error(self, path: str, message: str, hint: str | None = None) -> ConfigError:
        """Return an error with the place, if any, of the value at a path or of the first value below it."""
        value = self.get(path) if self.exists(path) else next(self.search(path), None)
        return ConfigError(message, hint=hint) if value is None else value.error(message, hint)

    def keys(self, path: str = "/") -> list[str]:
        """Return the path elements directly below a path, sorted; of a list of maps, in the list's order."""
        node = self._root.find(path)
        if node is None:
            return []
        return list(node.children) if node.kind is NodeKind.MAPS else sorted(node.children)

    def search(self, prefix: str = "/") -> Iterator[ConfigValue]:
        """Yield all values below a path, sorted by path, as Fawkes' ``Configuration::search``.

        The paths start with the prefix. A value at the prefix itself is not included.
        """
        yield from sorted(self.walk(prefix), key=lambda value: value.path)

    def walk(self, prefix: str = "/") -> Iterator[ConfigValue]:
        """Yield all values below a path in the order of the file."""
        prefix = prefix.removesuffix("/")
        node = self._root.find(prefix)
        if node is not None:
            for path, leaf in node.leaves(prefix):
                yield _make_value(path, leaf)

    def get_str(self, path: str, *, default: D | _Missing = _MISSING) -> str | D:
        """Return the text of a single value, empty for null."""
        return self._get_scalar(path, str, "a single value", default)

    def get_uint(self, path: str, *, default: D | _Missing = _MISSING) -> int | D:
        """Return a 32-bit unsigned integer, which may be hexadecimal (0x10) or octal (010)."""
        return self._get_scalar(path, to_uint32, "an unsigned integer", default)

    def get_port(self, path: str, *, default: int) -> int:
        """Return a port of a server; 0: any free port."""
        port = self.get_uint(path, default=default)
        if port > 65535:  # noqa: PLR2004 - ports have 16 bits
            raise self.error(path, f"{path} must not be {port}", "use a port from 0 to 65535")
        return port

    def get_int(self, path: str, *, default: D | _Missing = _MISSING) -> int | D:
        """Return a 32-bit integer."""
        return self._get_scalar(path, to_int, "an integer", default)

    def get_float(self, path: str, *, default: D | _Missing = _MISSING) -> float | D:
        """Return a number."""
        return self._get_scalar(path, to_float, "a number", default)

    def get_bool(self, path: str, *, default: D | _Missing = _MISSING) -> bool | D:
        """Return a truth value: true, yes, on, y or their opposites."""
        return self._get_scalar(path, to_bool, "true or false", default)

    def get_strings(self, path: str, *, default: D | _Missing = _MISSING) -> list[str] | D:
        """Return a list of texts."""
        return self._get_list(path, str, "a text", default)

    def get_uints(self, path: str, *, default: D | _Missing = _MISSING) -> list[int] | D:
        """Return a list of 32-bit unsigned integers."""
        return self._get_list(path, to_uint32, "an unsigned integer", default)

    def get_floats(self, path: str, *, default: D | _Missing = _MISSING) -> list[float] | D:
        """Return a list of numbers."""
        return self._get_list(path, to_float, "a number", default)

    def _get_scalar(
        self, path: str, convert: Callable[[str], T | None], expected: str, default: D | _Missing
    ) -> T | D:
        """Return the converted text of a single value, or the default.

        :param convert: returns None for a text of another type.
        :param expected: the type in words, for errors.
        """
        if not isinstance(default, _Missing) and self._root.find(path) is None:
            return default
        value = self.get(path)
        if value.is_list:
            raise _make_type_error(value, f"must be {expected}, but is a list")
        scalar = convert(value.text)
        if scalar is None:
            raise _make_type_error(value, f"must be {expected}, but is {_quote(value)}")
        return scalar

    def _get_list(
        self, path: str, convert: Callable[[str], T | None], expected: str, default: D | _Missing
    ) -> list[T] | D:
        """Return the converted elements of a list, or the default; parameters as in `_get_scalar`."""
        if not isinstance(default, _Missing) and self._root.find(path) is None:
            return default
        value = self.get(path)
        if not value.is_list:
            raise _make_type_error(
                value, f"must be a list, but is {_quote(value)}", f"write [{mask(path, value.text)}]"
            )
        elements = [convert(text) for text in value.items]
        if None in elements:
            index = elements.index(None)
            raise _make_type_error(
                value,
                f"must be a list, each element {expected}, "
                f"but element {index} is '{mask(path, value.items[index])}'",
            )
        return [element for element in elements if element is not None]

    def _make_missing_error(self, path: str, node: ConfigNode | None) -> ConfigError:
        """Return the error for a path without a value.

        :param node: the map or the list of maps at the path; None if the path has neither.
        """
        path = "/" + "/".join(split_path(path))
        if node is not None:
            return ConfigError(
                f"{path} holds {node.kind.value}, not a value",
                file=node.mark.file or None,
                line=node.mark.line or None,
                # the first eight, because a map may have hundreds of values
                hint=f"values below: {', '.join(list(node.children)[:8])}",
            )
        known_paths = (leaf for leaf, _ in self._root.leaves(""))
        return ConfigError(
            f"there is no configuration value {path}",
            file=self.files[0] if self.files else None,
            hint=self._find_host_hint(path)
            or did_you_mean(path, known_paths, cutoff=_MIN_PATH_SIMILARITY)
            or None,
        )

    def _find_host_hint(self, path: str) -> str:
        """Return a hint about the first file of another host with a value at a path; empty without one."""
        for include in self._host_includes:
            for host_path in sorted(include.parent.glob(include.name.replace("$host", "*", 1))):
                for file in list_config_files(host_path) if host_path.is_dir() else [host_path]:
                    with suppress(ConfigError):  # the file of another host may be invalid
                        if file not in self.files and Configuration.load(file).exists(path):
                            option = f"--config {shlex.quote(str(file))}"
                            return f"{file} defines the value for another host: {option}"
        return ""

    def below(self, path: str) -> Configuration:
        """Return a copy of the values below a path, without the files and warnings.

        The copy is empty if the path has neither a map nor a list of maps.
        """
        node = self._root.find(path)
        config = Configuration()
        if node is not None and node.kind in (NodeKind.MAP, NodeKind.MAPS):
            config._root = node.copy()
        return config

    def copy_below(self, path: str) -> Configuration:
        """Return a copy with all values moved below a path."""
        config = Configuration()
        node = self._root.copy()
        for element in reversed(split_path(path)):
            node = ConfigNode(NodeKind.MAP, node.mark, children={element: node})
        config._root = node
        return config

    def set(self, path: str, value: Scalar | Sequence[Scalar]) -> None:
        """Set a value for this run, without writing a file.

        :raises ConfigError: if the path leads through a value or to a map, or has too many elements.
        """
        elements = split_path(path)
        if len(elements) > MAX_DEPTH:  # the path may come from the network: quote only its beginning
            raise ConfigError(f"cannot set {path[:40]}...: the path has more than {MAX_DEPTH} elements")
        node = self._root
        for element in elements:
            if node.kind in (NodeKind.SCALAR, NodeKind.LIST):
                raise node.mark.error(f"cannot set {path}: '{element}' would be below {node.kind.value}")
            if node.kind is NodeKind.NULL:
                node.kind = NodeKind.MAP
            node = node.children.setdefault(element, ConfigNode(NodeKind.NULL, Mark()))
        if node.children or not elements:
            raise node.mark.error(f"cannot set {path}: it holds {node.kind.value}", "set the values below it")
        node.mark = Mark()
        if isinstance(value, bool | int | float | str):
            node.kind, node.text, node.items = NodeKind.SCALAR, _to_text(value), ()
        else:
            node.kind, node.text, node.items = NodeKind.LIST, "", tuple(_to_text(item) for item in value)

    def overlay_files(self, files: Path | Sequence[Path] | None) -> None:
        """Lay configuration files over this one, in order.

        :raises ConfigError: if a file cannot be read, or a value would replace a value of another kind.
        """
        for file in () if files is None else (files,) if isinstance(files, Path) else files:
            self.overlay(Configuration.load(file))

    def overlay(self, upper: Configuration) -> None:
        """Lay another configuration over this one; its values take precedence.

        :raises ConfigError: if a value would replace a value of another kind, such as a list in place of a
            scalar.
        """
        overlay(self._root, upper._root)
        self.files += upper.files
        self.warnings += upper.warnings
        self._host_includes += upper._host_includes


def _make_value(path: str, node: ConfigNode) -> ConfigValue:
    return ConfigValue(path, node.kind is NodeKind.LIST, node.text, node.items, node.mark)


def _quote(value: ConfigValue) -> str:
    return f"'{mask(value.path, value.text)}'" if value.text else "empty"


def _to_text(value: Scalar) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _make_type_error(value: ConfigValue, problem: str, hint: str | None = None) -> ConfigError:
    return value.mark.error(f"/{'/'.join(split_path(value.path))} {problem}", hint)
