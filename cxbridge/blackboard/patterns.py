"""The patterns that select interfaces: shell patterns for type and id, as people write them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Self

from cxbridge.blackboard.errors import InvalidNameError
from cxbridge.blackboard.names import check_names, matches

_HINT: Final = "write TYPE or TYPE::ID, with *, ?, [ab], [!ab]; e.g. 'SkillerInterface::*'"
_TYPE_GLOB: Final = re.compile(r"[A-Za-z0-9_*?\[\]!-]+")
_OPEN_BRACKET: Final = re.compile(r"\[[^\]]*$")


@dataclass(frozen=True, slots=True)
class Pattern:
    """Shell patterns for type and id."""

    type_glob: str
    id_glob: str = "*"

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read ``TYPE`` or ``TYPE::ID``, both with ``*``, ``?`` and ``[]``.

        :raises InvalidNameError: when a part is empty or too long, or no type can ever match.
        """
        type_glob, separator, id_glob = text.partition("::")
        try:
            check_names(type_glob, id_glob if separator else "*")
        except InvalidNameError as error:
            raise InvalidNameError(f"'{text}' selects no interface: {error.message}", hint=_HINT) from error
        if not _TYPE_GLOB.fullmatch(type_glob):
            raise InvalidNameError(
                f"'{text}' selects no interface: no type has such a name as '{type_glob}'", hint=_HINT
            )
        if _OPEN_BRACKET.search(type_glob):
            raise InvalidNameError(f"'{text}' selects no interface: a '[' is not closed", hint=_HINT)
        return cls(type_glob, id_glob if separator else "*")

    def matches(self, key: tuple[str, str]) -> bool:
        """Return whether it selects the interface of this type and id."""
        return matches(*key, self.type_glob, self.id_glob)


def escaped(name: str) -> str:
    """Return a pattern that only this type, or id, matches."""
    return re.sub(r"([*?\[])", r"[\1]", name)
