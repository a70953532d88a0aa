"""Mistakes in the definition of an interface."""

from __future__ import annotations

from typing import Final

from tests.mistakes.table.mistake import Mistake, mistake

_FILE: Final = "HelloInterface.xml"

MISTAKES: Final[tuple[Mistake, ...]] = (
    mistake("an element never closes", _FILE, "</data>", "", "not well-formed", "HelloInterface.xml:11"),
    mistake(
        "a type is misspelt",
        _FILE,
        'type="uint32" name="count"',
        'type="unit32" name="count"',
        "unit32",
        "HelloInterface.xml:6",
    ),
    mistake("a field has no name", _FILE, ' name="count"', "", "no attribute 'name'", "HelloInterface.xml:6"),
    mistake("a name comes twice", _FILE, 'name="count"', 'name="person"', "'person'", "HelloInterface.xml:6"),
    mistake(
        "the name is not that of the file",
        _FILE,
        '<interface name="HelloInterface"',
        '<interface name="HelloInterfaces"',
        "defines HelloInterfaces",
        "HelloInterface.xml:1",
    ),
    mistake(
        "an attribute has no quotes",
        _FILE,
        'year="2024"',
        "year=2024",
        "not well-formed",
        "HelloInterface.xml:2",
    ),
    mistake(
        "the type is misspelt where it is opened",
        "hello-domain.clp",
        '"HelloInterface"',
        '"HeloInterface"',
        "HeloInterface",
        "hello-domain.clp:14",
    ),
)
