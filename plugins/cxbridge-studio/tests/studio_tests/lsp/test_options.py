"""Invalid options: on the command line one error at once, from an editor's settings a message."""

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
def test_a_server_that_cannot_be_meant(arguments, message):
    done = nursery().run(["lsp", *arguments], folder=ROOT / "scenarios" / "test-scenario")
    assert done.returncode == 2
    assert done.stdout == b""
    assert message in done.stderr.decode()
    assert done.stderr.count(b"error:") == 1


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
def test_settings_of_an_editor_that_make_no_sense(tmp_path, options, message):
    root = shutil.copytree(ROOT / "scenarios" / "test-scenario", tmp_path / "agent")
    with closing(Editor(root, options=options)) as editor:
        editor.wait(lambda: bool(editor.client.messages))
        (told,) = editor.client.messages
        assert told.type is lsp.MessageType.Error
        assert message in told.message


def test_unknown_names_are_warnings_where_no_agent_is_known(tmp_path):
    """A file may be for another host: for CLIPS with more functions, or for another executive."""
    (tmp_path / "program.clp").write_text("(defrule r ?g <- (goal (color red)) => (fuzzify ?g))\n(defrule\n")
    with closing(Editor(tmp_path)) as editor:
        editor.open("program.clp")
        editor.wait(lambda: len(editor.shown("program.clp")) > 1)
        severities = {each.code: each.severity for each in editor.diagnostics("program.clp")}
        error, warning = lsp.DiagnosticSeverity.Error, lsp.DiagnosticSeverity.Warning
        assert severities == {"CX201": error, "CX203": warning, "CX204": warning}
