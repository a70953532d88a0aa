"""The table of operations: rows of plug-ins, and types of parameters."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from pathlib import Path
from typing import Any

import pytest
from msgspec import Struct

from cxbridge.daemon.operations.operation import (
    Operation,
    OperationContext,
    ParameterError,
)
from cxbridge.daemon.operations.table import OPERATION_MODULES, _load_operations, verbs
from cxbridge.errors import CxbridgeError
from cxbridge.plugins import PluginError
from cxbridge.rights import ALL_RIGHTS, Right
from tests.plugins import example, forget, install


@pytest.fixture(name="added")
def _added(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A plug-in with an operation."""
    install(tmp_path / "site", monkeypatch, "greeter", example())
    yield
    forget("greeter")


@pytest.mark.usefixtures("added")
def test_new_operation_is_one_row() -> None:
    assert verbs()["count-words"] is Right.CONTROL


def test_duplicate_name_of_operation_is_an_error() -> None:
    rows = OPERATION_MODULES.rows
    with pytest.raises(PluginError, match="both define the operation"):
        _load_operations((*rows, *map(copy, rows)))


# -- parameters


class _Search(Struct):
    env: str
    words: str
    after: int = 0
    slots: dict[str, str] = {}


def _search(_context: OperationContext, _parameters: _Search) -> None:
    """Find nothing."""


SEARCH = Operation("search", Right.LOOK, _Search, _search, (), is_verb=True)


@pytest.mark.parametrize(
    ("given", "wrong", "name"),
    [
        ({"env": "e"}, "'words' is missing", "words"),
        ({"env": "e", "words": "a", "after": "x"}, "after", "after"),
        ({"env": "e", "words": "a", "slots": {"a": 1}}, "slots", "slots"),
    ],
)
def test_parameters_have_types(given: dict[str, Any], wrong: str, name: str) -> None:
    with pytest.raises(ParameterError, match=wrong) as caught:
        SEARCH.parse(given)
    assert caught.value.name == name


def test_operation_without_executive_is_an_error() -> None:
    context = OperationContext(ALL_RIGHTS, None)
    with pytest.raises(CxbridgeError, match="this daemon has no executive"):
        _ = context.executive
