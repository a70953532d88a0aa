"""The sources of a run are recorded, listed and extracted."""

from __future__ import annotations

import json
from pathlib import Path, PurePosixPath

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import Writer

from cxbridge.config import Configuration
from cxbridge.errors import TraceError
from cxbridge.events import SourceRead
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.run import RunOptions, run_scenario
from cxbridge.trace.convert import convert
from cxbridge.trace.formats.base import Run
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.source_records import SourceRecordMaker
from cxbridge.trace.sources import extract_files, run_sources
from tests.support import ROOT
from tests.trace.runs import family


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Return a recording of the test scenario with its rules."""
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    run_scenario(RunOptions(scenario=ROOT / "scenarios" / "test-scenario", trace=path, trace_level="rules"))
    return open_run(path)


def test_attached_sources_equal_read_files(recorded: Run) -> None:
    sources = list(run_sources(recorded))
    for source in sources:
        if source.role in {"clips", "pddl", "config"}:
            assert source.data == Path(source.name).read_bytes(), source.name
    names = [source.name for source in sources if source.role == "clips"]
    assert [PurePosixPath(name).name for name in names[:3]] == ["utils.clp", "time.clp", "path.clp"]
    assert PurePosixPath(names[-1]).name == "temporal-over-duration.clp"
    assert {source.name for source in sources if source.role == "interface"} >= {"SkillerInterface"}
    assert {source.name for source in sources if source.role == "feature"} >= {"blackboard", "pddl-parser"}
    assert {source.name for source in sources if source.role == "skill"} >= {"skills/basic/say.lua"}
    (tree,) = [json.loads(source.data or b"") for source in sources if source.role == "config-tree"]
    assert tree["/clips-executive/spec"] == "test"
    numbered = [file.name for file in recorded.files() if file.name.startswith("clips/executive/")]
    assert [int(PurePosixPath(name).name[:4]) for name in numbered] == list(range(1, len(numbered) + 1))


def test_copy_has_sources_of_run(recorded: Run, tmp_path: Path) -> None:
    convert(recorded, tmp_path / "copy.mcap", "mcap")
    copy = open_run(tmp_path / "copy.mcap")
    assert list(copy.attachments()) == list(recorded.attachments())
    assert list(copy.source_records()) == list(recorded.source_records())


def test_equal_bytes_are_attached_once() -> None:
    record_maker = SourceRecordMaker()

    def attach(owner: str, data: bytes) -> tuple[str, bool]:
        event = SourceRead(1, "clips", owner, "/a/x.clp", data, {"how": "load", "within": ""})
        record, attachment = record_maker.make_record(event)
        assert "within" not in record
        return record["attachment"], attachment is not None

    assert attach("a", b"1") == ("clips/a/0001-x.clp", True)
    assert attach("b", b"1") == ("clips/a/0001-x.clp", False)
    assert attach("b", b"2") == ("clips/b/0002-x.clp", True)
    pddl = [
        record_maker.make_record(SourceRead(1, "pddl", "", "d.pddl", data, {}))[0]
        for data in (b"1", b"2", b"1")
    ]
    assert [record["attachment"] for record in pddl] == ["pddl/d.pddl", "pddl/d-2.pddl", "pddl/d.pddl"]


@given(
    st.sampled_from(["clips", "construct", "skill", "pddl", "config", "interface", "../x"]),
    st.text(),
    st.text(),
)
def test_names_of_attachments_are_safe(role: str, owner: str, name: str) -> None:
    _, attachment = SourceRecordMaker().make_record(SourceRead(1, role, owner, name, b"", {}))
    assert attachment is not None
    parts = attachment.name.split("/")
    assert len(parts) > 1
    assert not {"", ".", ".."} & set(parts)
    assert attachment.name.isascii()
    assert all(char.isalnum() or char in "-._/" for char in attachment.name)


def test_interfaces_and_configuration_are_extracted(recorded: Run, tmp_path: Path) -> None:
    files = extract_files(recorded, tmp_path / "out", "interfaces/*")
    assert tmp_path / "out" / "interfaces" / "SkillerInterface.xml" in files
    registry = InterfaceRegistry([tmp_path / "out" / "interfaces"], shipped=False)
    assert registry.schema("SkillerInterface").hash == InterfaceRegistry().schema("SkillerInterface").hash
    with pytest.raises(TraceError, match="the file exists already"):
        extract_files(recorded, tmp_path / "out")
    configuration = extract_files(recorded, tmp_path / "config", "config/*-*")
    assert Configuration.load(configuration[0]).get_str("/clips-executive/spec") == "test"


@pytest.mark.parametrize(
    "name", ["../evil", "/etc/evil", "a/../../evil", "a//b", "", ".", "a\\..\\b", "a\0b"]
)
def test_name_outside_of_folder_is_not_extracted(name: str, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="cxbridge")
        writer.add_attachment(0, 0, name, "text/plain", b"evil")
        writer.finish()
    with pytest.raises(TraceError, match="it is not extracted"):
        extract_files(open_run(path), tmp_path / "out")
    assert not (tmp_path / "out").exists()
    assert sorted(tmp_path.iterdir()) == [path]


def test_refused_extraction_leaves_no_file(tmp_path: Path) -> None:
    """The refused file, outside of the folder, existing or damaged, follows good files."""
    path = tmp_path / "run.mcap"

    def record_with(name: str) -> Run:
        with path.open("wb") as file:
            writer = Writer(file)
            writer.start(profile="cxbridge")
            for file_name in ("a", "b/c", name):
                writer.add_attachment(
                    0, 0, file_name, "text/plain", b"unharmed" if file_name == name else b"good"
                )
            writer.finish()
        return open_run(path)

    def check_refused(run: Run, reason: str) -> None:
        with pytest.raises(TraceError, match=reason):
            extract_files(run, out)
        assert [file for file in out.rglob("*") if file.is_file() and file != existing] == []

    out = tmp_path / "out"
    existing = out / "d"
    check_refused(record_with("../d"), "it is not extracted")
    run = record_with("d")
    out.mkdir(exist_ok=True)
    existing.touch()
    check_refused(run, "the file exists already")
    existing.unlink()
    check_refused(record_with("a"), "cannot be written")
    record_with("d")
    path.write_bytes(path.read_bytes().replace(b"unharmed", b"deformed"))
    check_refused(open_run(path), "damaged|checksum|CRC")


def test_damaged_attachment_is_error_but_events_are_read(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with McapWriter(path) as writer:
        writer.write(SourceRead(1, "pddl", "", "d.pddl", b"(define (domain unharmed))", {}))
        for event in family():
            writer.write(event)
    path.write_bytes(path.read_bytes().replace(b"unharmed", b"deformed"))
    run = open_run(path)
    (file,) = run.files()
    assert (list(run), file.time_us) == (family(), 1)
    with pytest.raises(TraceError, match=r"the attachment pddl/d.pddl is damaged: .*checksum"):
        file.read()
    with pytest.raises(TraceError, match="is damaged"):
        extract_files(run, tmp_path / "out")
    assert not (tmp_path / "out").exists()
