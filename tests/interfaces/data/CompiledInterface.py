"""The interface type CompiledInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.accessors import Array
from cxbridge.interfaces.classes import define, enum_value_name
from cxbridge.interfaces.instance import Interface, Message
from cxbridge.interfaces.pseudomap import PseudoMap
from cxbridge.interfaces.schema import schema_from_json

_DEFINITION = r"""
{
  "name": "CompiledInterface",
  "hash": "EstS1/zbtkUwXqk/00boOw==",
  "datasize": 88,
  "fields": [
    {
      "name": "mode",
      "type": "Mode",
      "length": null,
      "offset": 16,
      "size": 4,
      "elem_size": 4,
      "comment": "An enum.",
      "enum": {
        "name": "Mode",
        "items": [
          {
            "name": "SLOW",
            "value": 0,
            "comment": "Not fast."
          },
          {
            "name": "FAST",
            "value": 3,
            "comment": "Not slow; a comment that is long enough to be broken into several lines, twice as long as one of them."
          }
        ],
        "comment": "How fast."
      }
    },
    {
      "name": "text",
      "type": "string",
      "length": 32,
      "offset": 20,
      "size": 32,
      "elem_size": 1,
      "comment": "A text, with a \"quoted\" word and a \\ backslash."
    },
    {
      "name": "values",
      "type": "double",
      "length": 3,
      "offset": 56,
      "size": 24,
      "elem_size": 8,
      "comment": "An array."
    },
    {
      "name": "class",
      "type": "uint8",
      "length": null,
      "offset": 80,
      "size": 1,
      "elem_size": 1,
      "comment": "A name that Python has taken."
    },
    {
      "name": "on",
      "type": "bool",
      "length": null,
      "offset": 81,
      "size": 1,
      "elem_size": 1,
      "comment": "A bool.",
      "validfor": "3",
      "default": "true",
      "flags": [
        "changed_indicator"
      ]
    }
  ],
  "messages": [
    {
      "name": "MoveMessage",
      "datasize": 32,
      "fields": [
        {
          "name": "speed",
          "type": "float",
          "length": null,
          "offset": 16,
          "size": 4,
          "elem_size": 4,
          "comment": "A float."
        },
        {
          "name": "modes",
          "type": "Mode",
          "length": 2,
          "offset": 20,
          "size": 8,
          "elem_size": 4,
          "comment": "An array of enums.",
          "enum": {
            "name": "Mode",
            "items": [
              {
                "name": "SLOW",
                "value": 0,
                "comment": "Not fast."
              },
              {
                "name": "FAST",
                "value": 3,
                "comment": "Not slow; a comment that is long enough to be broken into several lines, twice as long as one of them."
              }
            ],
            "comment": "How fast."
          }
        },
        {
          "name": "mode",
          "type": "Mode",
          "length": null,
          "offset": 28,
          "size": 4,
          "elem_size": 4,
          "comment": "An enum.",
          "enum": {
            "name": "Mode",
            "items": [
              {
                "name": "SLOW",
                "value": 0,
                "comment": "Not fast."
              },
              {
                "name": "FAST",
                "value": 3,
                "comment": "Not slow; a comment that is long enough to be broken into several lines, twice as long as one of them."
              }
            ],
            "comment": "How fast."
          }
        }
      ],
      "comment": "A message with fields of its own and a reference."
    },
    {
      "name": "HaltMessage",
      "datasize": 16,
      "fields": [],
      "comment": "A message without fields."
    }
  ],
  "enums": [
    {
      "name": "Mode",
      "items": [
        {
          "name": "SLOW",
          "value": 0,
          "comment": "Not fast."
        },
        {
          "name": "FAST",
          "value": 3,
          "comment": "Not slow; a comment that is long enough to be broken into several lines, twice as long as one of them."
        }
      ],
      "comment": "How fast."
    }
  ],
  "constants": [
    {
      "name": "LIMIT",
      "type": "uint32",
      "value": 7,
      "comment": "A number."
    },
    {
      "name": "SCALE",
      "type": "float",
      "value": 0.10000000149011612,
      "comment": "A float."
    },
    {
      "name": "GREETING",
      "type": "string",
      "value": "say \"hello\"",
      "comment": "A text."
    }
  ],
  "pseudomaps": [
    {
      "name": "by_number",
      "type": "uint8",
      "keytype": "uint32",
      "refs": [
        {
          "field": "class",
          "key": "2"
        }
      ],
      "comment": "A pseudo map."
    }
  ],
  "comment": "Has one of everything, with a comment of more than one line, so that the writer of modules has to break it somewhere.",
  "author": "The cxbridge developers",
  "year": "2026",
  "created": "2026-11-21"
}
"""

SCHEMA = schema_from_json(_DEFINITION)


@define(SCHEMA)
class CompiledInterface(Interface):
    """The interface type CompiledInterface.

    Has one of everything, with a comment of more than one line, so that the writer of
    modules has to break it somewhere.
    """

    __slots__ = ()

    class Mode(IntEnum):
        """Values of type Mode.

        How fast.
        """

        SLOW = 0
        """Not fast."""

        FAST = 3
        """Not slow; a comment that is long enough to be broken into several lines,
        twice as long as one of them.
        """

    SLOW: ClassVar[Mode] = Mode.SLOW
    FAST: ClassVar[Mode] = Mode.FAST

    @staticmethod
    def tostring_Mode(value: int) -> str:
        """Return the name of a value, UNKNOWN if it has none."""
        return enum_value_name(CompiledInterface.Mode, value)

    LIMIT: ClassVar[int] = 7
    """A number."""

    SCALE: ClassVar[float] = 0.10000000149011612
    """A float."""

    GREETING: ClassVar[str] = 'say "hello"'
    """A text."""

    class MoveMessage(Message):
        """The message MoveMessage.

        A message with fields of its own and a reference.
        """

        __slots__ = ()

        speed: float
        """A float."""

        modes: Array[CompiledInterface.Mode]
        """An array of enums."""

        mode: CompiledInterface.Mode
        """An enum."""

        def __init__(
            self,
            speed: float = 0.0,
            modes: Sequence[CompiledInterface.Mode] = (),
            mode: CompiledInterface.Mode | int = 0,
        ) -> None:
            """Make a message; omitted values are zero."""
            super().__init__(speed, modes, mode)

    class HaltMessage(Message):
        """The message HaltMessage.

        A message without fields.
        """

        __slots__ = ()

    mode: Mode
    """An enum."""

    text: str
    """A text, with a 'quoted' word and a / backslash."""

    values: Array[float]
    """An array."""

    class_: int
    """A name that Python has taken."""

    on: bool
    """A bool."""

    by_number: PseudoMap
    """A pseudo map."""
