"""A value of a configuration, with its place."""

from __future__ import annotations

from msgspec import Struct

from cxbridge.config.documents import Mark
from cxbridge.config.scalars import ConfigType, type_of
from cxbridge.errors import ConfigError


class ConfigValue(Struct, frozen=True):
    """A leaf of the configuration: a scalar, a list of scalars, null or an empty map.

    :param path: the full path in the spelling of the caller.
    :param text: the unquoted text of a scalar, otherwise empty.
    :param items: the unquoted texts of the elements of a list.
    :param mark: the place in the file.
    """

    path: str
    is_list: bool
    text: str
    items: tuple[str, ...]
    mark: Mark

    @property
    def type(self) -> ConfigType:
        """The type by Fawkes' rules, for a list that of its *first* element.

        An empty list is a UINT, the first of the types. Null is an empty STRING.
        """
        if self.is_list:
            return type_of(self.items[0]) if self.items else ConfigType.UINT
        return type_of(self.text)

    def error(self, message: str, hint: str | None = None) -> ConfigError:
        """Return an error with the file and line of this value."""
        return ConfigError(message, file=self.file or None, line=self.line or None, hint=hint)

    @property
    def file(self) -> str:
        """The file, empty for a value set at run time."""
        return self.mark.file

    @property
    def line(self) -> int:
        """The line from 1; 0 for a value set at run time."""
        return self.mark.line

    @property
    def location(self) -> str:
        """``FILE:LINE``; empty for a value set at run time."""
        return f"{self.file}:{self.line}" if self.file else ""
