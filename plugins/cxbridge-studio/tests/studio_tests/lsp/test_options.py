"""Invalid options are an error on the command line, and a message for settings of an editor."""

from __future__ import annotations

import shutil
from contextlib import closing

import pytest
from lsprotocol import types as lsp

from studio_tests.lsp.conftest import Editor
from tests.forked import nursery
from tests.support import ROOT, share


@pytest.mark.parametrize(
    ("arguments", "message"),
    share(
        [
            (("--core", "zebra"), "--core cannot be 'zebra'"),
            (("--clips-dir", "/nowhere"), "/nowhere: there is no such folder"),
            (("--recording", "/nowhere.mcap"), "/nowhere.mcap: there is no such recording"),
        ],
        4,
    ),
    ids=" ".join,
)
def test_invalid_command_line_option_is_an_error(arguments, message):
    process = nursery().run(["lsp", *arguments], folder=ROOT / "scenarios" / "test-scenario")
    assert process.returncode == 2
    assert process.stdout == b""
    assert message in process.stderr.decode()
    assert process.stderr.count(b"error:") == 1


@pytest.mark.parametrize(
    ("options", "message"),
    share(
        [
            ({"core": "zebra"}, "--core cannot be 'zebra'"),
            ({"spec": "zebra"}, "the configuration has no spec 'zebra'"),
            ({"specs": "test"}, "a run has no option 'specs'"),
            ({"clips_dirs": 3}, "'clips_dirs' cannot be 3"),
            ({"scenario": 3}, "'scenario' cannot be 3"),
            ({"clips_dirs": ["/nowhere"]}, "/nowhere: there is no such folder"),
        ],
        3,
    ),
    ids=str,
)
def test_invalid_editor_setting_is_an_error_message(tmp_path, options, message):
    root = shutil.copytree(ROOT / "scenarios" / "test-scenario", tmp_path / "agent")
    with closing(Editor(root, options=options)) as editor:
        editor.wait_until(lambda: bool(editor.client.messages))
        (notification,) = editor.client.messages
        assert notification.type is lsp.MessageType.Error
        assert message in notification.message


def test_unknown_names_are_warnings_without_agent(tmp_path):
    """A file without an agent may be for a CLIPS with further functions, or for a different executive."""
    (tmp_path / "program.clp").write_text("(defrule r ?g <- (goal (color red)) => (fuzzify ?g))\n(defrule\n")
    with closing(Editor(tmp_path)) as editor:
        editor.open("program.clp")
        editor.wait_until(lambda: len(editor.list_codes("program.clp")) > 1)
        severities = {
            diagnostic.code: diagnostic.severity for diagnostic in editor.diagnostics("program.clp")
        }
        error, warning = lsp.DiagnosticSeverity.Error, lsp.DiagnosticSeverity.Warning
        assert severities == {"CX201": error, "CX203": warning, "CX204": warning}
