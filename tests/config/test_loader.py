"""Includes: order, folders, optional files, the file of the host, and errors."""

from __future__ import annotations

import contextlib
import socket
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from tests.support import many
from tests.unprivileged import unprivileged

patient = settings(max_examples=many(100, 25), deadline=None, suppress_health_check=[HealthCheck.too_slow])


def write(folder: Path, name: str, *documents: str) -> Path:
    file = folder / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("\n---\n".join(documents) + "\n")
    return file


def load_error(path: Path) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        Configuration.load(path)
    return caught.value


def test_included_files_overlay_breadth_first(tmp_path: Path) -> None:
    main = write(
        tmp_path, "config.yaml", "include: [one.yaml, two.yaml]", "a: main\nb: main\nc: main\nd: main"
    )
    write(tmp_path, "one.yaml", "include: [deep.yaml]", "b: one\nc: one\nd: one")
    write(tmp_path, "two.yaml", "c: two\nd: two")
    write(tmp_path, "deep.yaml", "d: deep")
    config = Configuration.load(main)
    assert [config.get_str(path) for path in ("a", "b", "c", "d")] == ["main", "one", "two", "deep"]
    assert [file.name for file in config.files] == ["config.yaml", "one.yaml", "two.yaml", "deep.yaml"]


def test_relative_includes_start_at_main_folder(tmp_path: Path) -> None:
    main = write(tmp_path, "config.yaml", "include: [sub/one.yaml]", "a: 1")
    write(tmp_path, "sub/one.yaml", "include: [two.yaml]", "b: 1")
    write(tmp_path, "two.yaml", "c: 1")
    assert Configuration.load(main).exists("/c")
    other = write(tmp_path, "elsewhere/config.yaml", "include: [two.yaml]", "a: 1")
    assert Configuration.load(other, confdir=tmp_path).exists("/c")


def test_folder_includes_sorted_yaml_files_without_subfolders(tmp_path: Path) -> None:
    main = write(tmp_path, "config.yaml", "include: [conf.d/]", "x: main")
    for name in ("b.yaml", "a.yaml", ".hidden.yaml", "c.yml", "with blank.yaml", "sub/d.yaml", "e.yaml.orig"):
        write(tmp_path / "conf.d", name, f"x: {name}")
    config = Configuration.load(main)
    assert [file.name for file in config.files] == ["config.yaml", "a.yaml", "b.yaml"]
    assert config.get_str("/x") == "b.yaml"


def test_folder_is_loaded(tmp_path: Path) -> None:
    write(tmp_path, "b.yaml", "x: b")
    write(tmp_path, "a.yaml", "x: a\ny: a")
    config = Configuration.load(tmp_path)
    assert (config.get_str("x"), config.get_str("y")) == ("b", "a")
    write(tmp_path, "config.yaml", "z: 1")
    assert not Configuration.load(tmp_path).exists("x")


def test_missing_files_are_ignored_on_request(tmp_path: Path) -> None:
    main = write(
        tmp_path,
        "config.yaml",
        "include:\n- !ignore-missing no.yaml\n- !ignore-missing no.d/\n- yes.yaml",
        "a: 1",
    )
    write(tmp_path, "yes.yaml", "b: 1")
    assert Configuration.load(main).exists("/b")


def test_host_specific_file_overlays_all_files(tmp_path: Path) -> None:
    main = write(
        tmp_path, "config.yaml", "include:\n- !host-specific $host.yaml\n- one.yaml", "a: main\nb: main"
    )
    write(tmp_path, "one.yaml", "a: one")
    assert Configuration.load(main, host="robot").get_str("a") == "one"
    write(tmp_path, "robot.yaml", "a: robot")
    assert Configuration.load(main, host="robot").get_str("a") == "robot"
    write(tmp_path, f"{socket.gethostname()}.yaml", "a: here")
    assert Configuration.load(main).get_str("a") == "here"


def test_host_file_may_not_include(tmp_path: Path) -> None:
    main = write(tmp_path, "config.yaml", "include: [!host-specific h.yaml]", "a: 1")
    write(tmp_path, "h.yaml", "include: [other.yaml]", "a: 2")
    assert "may not include files" in load_error(main).message


def test_meta_document_without_includes(tmp_path: Path) -> None:
    for meta in ("doc-url: !url http://x/y", "include:", "~"):
        assert Configuration.load(write(tmp_path, "c.yaml", meta, "a: 1")).get_uint("/a") == 1


@pytest.mark.parametrize("documents", [("",), ("# comment",), ("a: 1", ""), ("~",)])
def test_empty_files_and_documents(tmp_path: Path, documents: tuple[str, ...]) -> None:
    config = Configuration.load(write(tmp_path, "c.yaml", *documents))
    assert not list(config.search())
    assert len(config.files) == 1


def test_error_of_missing_include_has_line(tmp_path: Path) -> None:
    main = write(tmp_path, "config.yaml", "include:\n  - gone.yaml", "a: 1")
    problem = load_error(main)
    assert (problem.file, problem.line) == (str(main), 2)
    assert str(tmp_path / "gone.yaml") in problem.message
    assert "!ignore-missing" in str(problem.hint)


def test_missing_main_file(tmp_path: Path) -> None:
    problem = load_error(tmp_path / "no.yaml")
    assert problem.message == "cannot read the configuration: no such file or directory"
    assert problem.file == str(tmp_path / "no.yaml")
    assert "no configuration" in load_error(tmp_path).message


def test_unreadable_file_is_not_ignored(tmp_path: Path) -> None:
    main = write(tmp_path, "config.yaml", "include: [!ignore-missing x.yaml]", "a: 1")
    write(tmp_path, "x.yaml", "a: 2").chmod(0)
    with unprivileged():
        assert "permission denied" in load_error(main).message


@pytest.mark.parametrize(
    ("meta", "message"),
    [
        ("include: one.yaml", "must be a list"),
        ("include: [[a]]", "an include must be the name"),
        ("include: ['']", "the include is empty"),
        ('include: ["a\\0b"]', "the include is empty"),
        ("include: [~]", "the include is empty"),
        ("include: [!url a]", "unknown tag|first of two"),
        ("include: [!ignore-mising a]", "unknown tag !ignore-mising"),
        ("[include]", "must be a map"),
    ],
)
def test_invalid_meta_documents_are_errors(tmp_path: Path, meta: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        Configuration.load(write(tmp_path, "c.yaml", meta, "a: 1"))
    assert caught.value.line == 1


def test_cycle_of_includes_is_shown(tmp_path: Path) -> None:
    main = write(tmp_path, "config.yaml", "include: [one.yaml]", "a: 1")
    one = write(tmp_path, "one.yaml", "include:\n\n- config.yaml", "b: 1")
    problem = load_error(main)
    assert (problem.file, problem.line) == (str(one), 3)
    assert f"{main} -> {one} -> {main}" in problem.message


def test_number_of_includes_is_bounded(tmp_path: Path) -> None:
    for level in range(12):
        write(tmp_path, f"l{level}.yaml", f"include: [l{level + 1}.yaml, l{level + 1}.yaml]", "a: 1")
    write(tmp_path, "l12.yaml", "a: 1")
    assert "more than 1000 files" in load_error(tmp_path / "l0.yaml").message


@patient
@given(st.binary(max_size=60), st.binary(max_size=60))
def test_random_files_load_or_raise_one_error(first: bytes, second: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        main = Path(folder) / "config.yaml"
        main.write_bytes(b"include: [x.yaml]\n---\n" + first)
        (Path(folder) / "x.yaml").write_bytes(second)
        with contextlib.suppress(ConfigError):
            Configuration.load(main)
