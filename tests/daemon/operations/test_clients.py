"""Clients of a daemon use the operations and parameters of the table."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from cxbridge.daemon.operations.table import operations
from tests.support import module_files, short_path

ASKING = {"ask_daemon": 1, "request": 1, "_request": 0}
"""Functions that request an operation, with the position of its name among the arguments."""
CLIENTS = (
    "cli/",
    "daemon/client.py",
    "cxbridge_studio/monitor/",
    "cxbridge_studio/cli/",
    "cxbridge_ros2/cli/",
)
ADDED = {"debug_prompt.py": "env"}
"""A parameter that a client adds to every request with such a parameter."""


def calls_in(text: str) -> Iterator[tuple[str, set[str], bool]]:
    """Yield the requests in a source: the verb, its parameters, and whether these are all."""
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Call):
            continue
        name = getattr(node.func, "id", getattr(node.func, "attr", ""))
        place = ASKING.get(name)
        if place is None or len(node.args) <= place:
            continue
        given = {keyword.arg for keyword in node.keywords if keyword.arg is not None}
        for verb in ast.walk(node.args[place]):
            if isinstance(verb, ast.Constant) and isinstance(verb.value, str):
                yield verb.value, given, all(keyword.arg for keyword in node.keywords)


def complaints(verb: str, given: set[str], *, is_all: bool, added: str = "") -> list[str]:
    """Return the errors of a request."""
    if verb not in operations():
        return [f"there is no operation '{verb}'"]
    fields = {field.encode_name: field for field in msgspec.structs.fields(operations()[verb].parameters)}
    found = [f"{verb} has no parameter '{name}'" for name in given - fields.keys()]
    if is_all:
        found += [
            f"{verb} needs '{name}'"
            for name, field in fields.items()
            if field.required and name not in {*given, added}
        ]
    return found


def clients() -> list[Path]:
    """The sources with requests to a daemon."""
    return [
        file
        for file in module_files().values()
        if short_path(file).startswith(CLIENTS) and any(calls_in(file.read_text()))
    ]


@pytest.mark.parametrize("file", clients(), ids=short_path)
def test_requests_match_table_of_operations(file):
    wrong = [
        complaint
        for verb, given, is_all in calls_in(file.read_text())
        for complaint in complaints(verb, given, is_all=is_all, added=ADDED.get(file.name, ""))
    ]
    assert wrong == []


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("ask_daemon(url, 'env-lost')", ["there is no operation 'env-lost'"]),
        (
            "ask_daemon(url, 'component-list', most=1)",
            ["component-list has no parameter 'most'"],
        ),
        (
            "ask_daemon(url, 'component-change', component=name)",
            ["component-change needs 'transition'"],
        ),
        (
            "self._request('component-list' if every else 'component-lis')",
            ["there is no operation 'component-lis'"],
        ),
    ],
)
def test_wrong_requests_are_found(source, expected):
    [*found] = calls_in(source)
    assert [
        text for verb, given, is_all in found for text in complaints(verb, given, is_all=is_all)
    ] == expected
