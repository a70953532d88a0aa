"""YAML to bare nodes: marks, tags, anchors, and the bounds."""

from __future__ import annotations

import contextlib

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cxbridge.config.documents import MAX_DEPTH, YamlMap, parse_documents
from cxbridge.errors import ConfigError
from tests.support import many

patient = settings(max_examples=many(100, 25), deadline=None, suppress_health_check=[HealthCheck.too_slow])


def only(text: str) -> YamlMap:
    (document,) = parse_documents(text, "a.yaml")
    assert isinstance(document, YamlMap)
    return document


def error(text: str | bytes) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        parse_documents(text, "a.yaml")
    assert caught.value.file == "a.yaml"
    return caught.value


def test_tags_are_equal_with_and_without_directive() -> None:
    declared = "%YAML 1.2\n%TAG ! tag:fawkesrobotics.org,cfg/\n---\na: !url x\n---\na: !url x\n"
    for document in parse_documents(declared, "a.yaml"):
        assert isinstance(document, YamlMap)
        assert document.pairs[0][1].tag == "url"


def test_tags_of_yaml_select_type() -> None:
    values = [value for _, value in only("a: !!str 5\nb: !!seq [1]\nc: !!map {d: 1}\nd: !!int x\n").pairs]
    assert [value.tag for value in values] == ["", "", "", ""]
    assert (
        only("a: !!python/object:os.system x").pairs[0][1].tag == "tag:yaml.org,2002:python/object:os.system"
    )


def test_billion_laughs_is_refused_before_it_grows() -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 12)]
    problem = error("\n".join(lines))
    assert "expands to more than" in problem.message
    assert problem.line is not None


@pytest.mark.parametrize(
    ("text", "line", "expected_text"),
    [
        ("a: [1, 2\nb: 3\n", 2, "not valid YAML"),
        ("a: b: c\n", 1, "not valid YAML"),
        ("a: 1\n\tb: 2\n", 2, "not valid YAML"),
        ("a: 'open\n", 2, "not valid YAML"),
        ("a: !<x\n", 1, "not valid YAML"),
        ("a: 1\nb: \x07\n", 2, "not valid YAML"),
        ("a: 1\nb: &x [*x]\n", 2, "inside its own anchor"),
        ("a: *glob\n", 1, "quote"),
        ("a: &x 1\n---\nb: *x\n", 3, "there is no anchor &x"),
        *(  # Fawkes has a key ``<<`` then, without a reader
            (f"a: &a {{b: 1}}\nc:\n  {key}: *a\n", 3, "'<<' does not merge maps, as in Fawkes")
            for key in ("<<", "'<<'", "!!merge <<")
        ),
        *(
            (text, 1, f"more than {MAX_DEPTH} deep")
            for text in ("[" * 100_000, "{a: " * 50_000, "- " * 20_000)
        ),
        (b"a: 1\nb: \xff\xfe\n", 2, "save it as UTF-8"),
    ],
)
def test_syntax_error_has_line(text: str | bytes, line: int, expected_text: str) -> None:
    problem = error(text)
    assert expected_text in f"{problem.message} {problem.hint}"
    assert problem.line == line


def check_one_error_at_most(text: str | bytes) -> None:
    with contextlib.suppress(ConfigError):
        parse_documents(text, "a.yaml")


@patient
@given(st.text(alphabet="ab01-:[]{},&*!|>'\"%#? \n\t\ud800~/\x00", max_size=60))
def test_random_text_is_yaml_or_one_error(text: str) -> None:
    check_one_error_at_most(text)


@pytest.mark.parametrize(
    "text", ["a: !url [x, &y 'z', *y]\nb: ~\n---\nc: |\n  t\n", "a: [1, 2\nb: 3\n", "a: *x"]
)
def test_parser_in_python_reads_same_documents(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def outcome() -> object:
        try:
            return parse_documents(text, "a.yaml")
        except ConfigError as problem:
            return problem.line

    with_c = outcome()
    monkeypatch.delattr(yaml, "CLoader", raising=False)
    assert outcome() == with_c


@pytest.mark.parametrize(("text", "hint"), [("a:\n\tb: 1", "blanks"), ("a: b: c", "quote a value that has")])
def test_syntax_errors_have_hints(text: str, hint: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_documents(text, "a.yaml")
    assert hint in str(caught.value.hint)
