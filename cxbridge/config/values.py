"""One value of a configuration, with its place."""

from __future__ import annotations

from msgspec import Struct

from cxbridge.config.documents import Mark
from cxbridge.config.scalars import ConfigType, type_of
from cxbridge.errors import ConfigError


class ConfigValue(Struct, frozen=True):
    """A leaf of the configuration: a scalar, a list of scalars, or nothing (null, an empty map).

    :param path: its full path, in the spelling of the caller.
    :param is_list: whether it is a list.
    :param text: the raw text of a scalar without YAML's quotes, empty for nothing and for a list.
    :param items: the raw texts of the elements of a list.
    :param mark: where it was read.
    """

    path: str
    is_list: bool
    text: str
    items: tuple[str, ...]
    mark: Mark

    @property
    def type(self) -> ConfigType:
        """The type, by Fawkes' rules: of the text, or of the *first* element of a list.

        An empty list is of every type, and so of the first, UINT. Nothing is an empty STRING.
        """
        if self.is_list:
            return type_of(self.items[0]) if self.items else ConfigType.UINT
        return type_of(self.text)

    def error(self, message: str, hint: str | None = None) -> ConfigError:
        """Return an error about this value, with its file and line."""
        return ConfigError(message, file=self.file or None, line=self.line or None, hint=hint)

    @property
    def file(self) -> str:
        """The file that the value is from; empty when it was set at run time."""
        return self.mark.file

    @property
    def line(self) -> int:
        """The line in that file, from 1; 0 when the value was set at run time."""
        return self.mark.line
