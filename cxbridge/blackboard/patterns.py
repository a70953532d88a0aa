"""Shell patterns that select interfaces by type and id."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Self

from cxbridge.blackboard.errors import InvalidNameError
from cxbridge.blackboard.names import check_names, matches

_HINT: Final = "write TYPE or TYPE::ID, with *, ?, [ab], [!ab]; e.g. 'SkillerInterface::*'"
_TYPE_GLOB: Final = re.compile(r"[A-Za-z0-9_*?\[\]!-]+")


@dataclass(frozen=True, slots=True)
class Pattern:
    """Shell patterns for the type and the id of interfaces."""

    type_glob: str
    id_glob: str = "*"

    @classmethod
    def parse(cls, text: str) -> Self:
        """Parse ``TYPE`` or ``TYPE::ID``.

        :raises InvalidNameError: if a pattern is empty or too long, the type's pattern has a character that
            belongs neither to types nor to patterns, or the id's pattern has a NUL.
        """
        type_glob, separator, id_glob = text.partition("::")
        try:
            check_names(type_glob, id_glob if separator else "*")
        except InvalidNameError as error:
            raise InvalidNameError(f"'{text}' selects no interface: {error.message}", hint=_HINT) from error
        if not _TYPE_GLOB.fullmatch(type_glob):
            raise InvalidNameError(
                f"'{text}' selects no interface: '{type_glob}' cannot match a type's name", hint=_HINT
            )
        return cls(type_glob, id_glob if separator else "*")

    def matches(self, key: tuple[str, str]) -> bool:
        """Return whether the pattern selects the interface of a type and an id."""
        return matches(*key, self.type_glob, self.id_glob)


def escape_glob(name: str) -> str:
    """Return a shell pattern that matches only ``name``."""
    return re.sub(r"([*?\[])", r"[\1]", name)
