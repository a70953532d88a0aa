"""The names in .proto files are those that Google's compiler finds; uses in CLIPS lead to them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge_studio.agent.model import AgentModel
from cxbridge_studio.agent.names import Name, NameKind, Use
from cxbridge_studio.agent.protobuf import read_proto
from tests.support import ROOT

OURS = ROOT / "tests" / "protos"
FOLDERS = [OURS, *(Path(each) for each in [os.environ.get("RCLL_PROTOS", "")] if each)]
"""RCLL_PROTOS: a checkout of robocup-logistics/rcll-protobuf-msgs."""


def compiled(file: Path, out: Path) -> set[tuple[str, str]]:
    """Return messages and fields of a file as protoc has them; a message itself has no field."""
    descriptor_pb2 = pytest.importorskip("google.protobuf.descriptor_pb2", reason="needs protobuf")
    pytest.importorskip("grpc_tools", reason="needs grpcio-tools")
    subprocess.run(
        [sys.executable, "-m", "grpc_tools.protoc", f"-I{file.parent}", f"-o{out}", str(file)], check=True
    )
    (found,) = descriptor_pb2.FileDescriptorSet.FromString(out.read_bytes()).file
    names: set[tuple[str, str]] = set()

    def add(message, outer):
        if message.options.map_entry:
            return  # made by the compiler
        full = f"{outer}.{message.name}".lstrip(".")
        names.add((full, ""))
        names.update((full, field.name) for field in message.field)
        for nested in message.nested_type:
            add(nested, full)

    for message in found.message_type:
        add(message, found.package)
    return names


@pytest.mark.parametrize(
    "file", [file for folder in FOLDERS for file in sorted(folder.rglob("*.proto"))], ids=str
)
def test_the_names_are_those_of_the_compiler(file, tmp_path):
    read = read_proto(str(file), file.read_text())
    ours = {
        (name.text, "") if name.kind is NameKind.PROTO_MESSAGE else (name.owner, name.text)
        for name in (mention.name for mention in read.mentions)
    }
    assert ours == compiled(file, tmp_path / "out")
    for mention in read.mentions:
        written = read.text[mention.start : mention.end]
        assert mention.name.text.rpartition(".")[2] == written


@given(st.text(alphabet='message{}; =1."/*\nxoptionalenum', max_size=80))
def test_any_text_is_read(text):
    read_proto("a.proto", text)


CLIPS = """
(defrule answer
  ?f <- (protobuf-msg (type "test_msgs.Order") (ptr ?order))
  =>
  (bind ?report (pb-create "test_msgs.Report"))
  (pb-set-field ?report "robot" (pb-field-value ?order "text"))
  (pb-set-field ?other "robot" 1)
)
"""


def test_uses_in_clips_lead_to_the_definitions():
    model = AgentModel()
    model.update("a.clp", CLIPS)
    assert model.read(OURS / "report.proto")
    for name in (
        Name(NameKind.PROTO_MESSAGE, "test_msgs.Report"),
        Name(NameKind.PROTO_MESSAGE, "test_msgs.Order"),
        Name(NameKind.PROTO_FIELD, "robot", "test_msgs.Report"),
        Name(NameKind.PROTO_FIELD, "text", "test_msgs.Order"),
    ):
        (defined,) = model.find_mentions(name, Use.DEFINED)
        assert defined.file.path.endswith("report.proto")
        (used,) = (each for each in model.find_mentions(name) if each.file.path == "a.clp")
        assert CLIPS[used.mention.start : used.mention.end] == name.text
