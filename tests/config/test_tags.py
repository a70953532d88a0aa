"""Values must be what their tag says, as in Fawkes."""

from __future__ import annotations

import pytest

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError

HEAD = "%YAML 1.2\n%TAG ! tag:fawkesrobotics.org,cfg/\n---\n"


@pytest.mark.parametrize(
    "value",
    [
        "!ipv4 127.0.0.1",
        '!ipv6 "::1"',
        "!tcp-port 1910",
        "!udp-port 65534",
        "!url http://www.fawkesrobotics.org/#a?b",
        "!url nonsense",  # Fawkes' pattern matches any text
        "!frame robot/base-link",
        "!ipv4-addr 224.16.0.1",
    ],
)
def test_valid_values_of_tags(value: str) -> None:
    assert Configuration.from_text(f"{HEAD}a: {value}\n").exists("/a")


@pytest.mark.parametrize(
    ("value", "hint"),
    [
        ("!ipv4 localhost", "IPv4"),
        ("!ipv4 1.2.3", "IPv4"),
        ("!ipv6 127.0.0.1", "IPv6"),
        ("!tcp-port 0", "port"),
        ("!tcp-port 65535", "port"),
        ("!udp-port many", "port"),
        ("!frame 1base", "frame"),
        ("!frame /base_link", "frame"),
        ("!frame", "frame"),
        ("!url [a, b]", "URL"),
    ],
)
def test_invalid_values_of_tags_have_place_and_hint(value: str, hint: str) -> None:
    with pytest.raises(ConfigError) as caught:
        Configuration.from_text(f"{HEAD}a:\n  b: {value}\n", "c.yaml")
    problem = caught.value
    assert (problem.file, problem.line, problem.column) == ("c.yaml", 5, 6)
    assert hint in str(problem.hint)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("a:\n- !ipv4 1.2.3.4\n- !ipv4 x\n", 3, "IPv4"),
        ('a: !!python/object/apply:os.system ["touch /tmp/never"]\n', 1, "unknown tag"),
        ("include:\n  - !ignore-missing conf.d/\n", 2, "first of two documents"),
    ],
)
def test_invalid_tags_are_errors(text: str, line: int, message: str) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        Configuration.from_text(text)
    assert caught.value.line == line
