"""Code lenses with the number of firings of rules in the last recording."""

from __future__ import annotations

import asyncio
import shutil
from contextlib import closing

from lsprotocol import types as lsp

from cxbridge.cli.main import invoke
from studio_tests.lsp.conftest import Editor
from tests.support import ROOT


def test_code_lens_of_rule_has_number_of_firings(tmp_path):
    root = tmp_path.resolve()
    shutil.copytree(ROOT / "scenarios" / "test-scenario-pddl", root, dirs_exist_ok=True)
    shutil.copytree(ROOT / "luaskills" / "basic", root / "skills")
    run = [str(root), "--clock", "virtual", "--trace", str(root / "last.mcap"), "--trace-level", "rules"]
    assert invoke(["run", *run, "--quiet"]) == 0
    with closing(Editor(root)) as editor:
        editor.open("meet-goals.clp")
        document = lsp.TextDocumentIdentifier(editor.uri("meet-goals.clp"))

        def list_lens_titles() -> list[str]:
            lenses = editor.run(editor.client.text_document_code_lens_async(lsp.CodeLensParams(document)))
            return [lens.command.title for lens in lenses or () if lens.command]

        while not (titles := list_lens_titles()):
            editor.run(asyncio.sleep(0.1))
        assert titles[:2] == ["fired once in last.mcap", "fired once in last.mcap"]
        assert "never fired in last.mcap" in titles
