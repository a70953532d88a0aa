"""The editor knows the protobuf messages of the agent: their fields, and their definitions."""

from __future__ import annotations

import shutil
from collections.abc import Iterator

import pytest
from lsprotocol import types as lsp

from studio_tests.lsp.conftest import Editor
from tests.support import ROOT

CLIPS = """(defrule report
  (protobuf-msg (type "test_msgs.Order") (ptr ?order))
  =>
  (bind ?report (pb-create "test_msgs.Report"))
  (pb-set-field ?report "robot" (pb-field-value ?order "text"))
)
"""

PROTOS = ROOT / "tests" / "protos"


@pytest.fixture(scope="module")
def pb_editor(tmp_path_factory) -> Iterator[Editor]:
    """An editor that has an agent with protobuf messages open."""
    root = tmp_path_factory.mktemp("agent").resolve()
    shutil.copytree(ROOT / "scenarios" / "test-scenario-pddl", root, dirs_exist_ok=True)
    protos = tmp_path_factory.mktemp("protos")
    shutil.copytree(PROTOS, protos, dirs_exist_ok=True)
    scenario = root / "scenario.yaml"
    scenario.write_text(f"{scenario.read_text()}\nclips-protobuf:\n  proto-dirs: ['{protos}']\n")
    editor = Editor(root)
    try:
        editor.open("probe.clp", "(defrule probe => (no-such-function))\n")
        editor.wait(lambda: editor.shown("probe.clp") == [("CX204", 1)])  # all files are read
        editor.open("pb.clp", CLIPS)
        yield editor
    finally:
        editor.close()


def test_hover_shows_a_message_and_a_field(pb_editor):
    assert "message Order {" in pb_editor.hover("pb.clp", "test_msgs.Order")
    shown = pb_editor.hover("pb.clp", "robot")
    assert "required string robot = 1;" in shown
    assert "of test_msgs.Report" in shown
    assert "optional string text = 2;" in pb_editor.hover("pb.clp", 'text"))')


def test_a_definition_is_in_the_proto_file(pb_editor):
    place = lsp.DefinitionParams(**pb_editor.at("pb.clp", "robot"))
    found = pb_editor.run(pb_editor.client.text_document_definition_async(place))
    assert pb_editor.places(found) == [("report.proto", 17)]


def test_messages_and_fields_are_completed(pb_editor):
    pb_editor.open("typed.clp", CLIPS.replace("test_msgs.Report", ""))
    assert {"test_msgs.Report", "test_msgs.Order"} <= set(pb_editor.complete("typed.clp", '(pb-create "'))
    pb_editor.open("typed.clp", CLIPS.replace("robot", ""))
    fields = pb_editor.complete("typed.clp", '(pb-set-field ?report "')
    assert {"robot", "places"} <= set(fields)
    assert "text" not in fields
    pb_editor.open("typed.clp", ";; nothing\n")
