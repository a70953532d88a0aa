"""An operation of a plug-in can be typed at the prompt."""

from __future__ import annotations

from typing import Any

import pytest

from studio_tests.cli.test_run_break import _folder, _run  # noqa: F401 - fixtures
from tests.daemon.operations.test_table import _added  # noqa: F401 - a fixture


@pytest.mark.usefixtures("added")
def test_a_new_operation_can_be_typed_at_the_prompt(run: Any) -> None:
    status, out, _ = run(["goal:MINI:FORMULATED"], "count-words one", "env-list", "d 1", "c")
    assert status == 0
    assert '\n{"count": 1}\n' in out
    assert "there is no command 'env-list'" in out  # not all are for a prompt
