"""Which hosts and origins of requests a server permits."""

from __future__ import annotations

import pytest

from cxbridge_web.origins import has_host_name, is_permitted_request


@pytest.mark.parametrize(
    ("origin", "expected"),
    [
        *((each, True) for each in ("", "http://localhost:1", "HTTP://LOCALHOST:1", "https://ours.example")),
        *(
            (each, False)
            for each in ("null", "http://localhost", "https://localhost:1", "http://evil.example")
        ),
    ],
)
def test_pages_of_other_origins_are_strangers(origin: str, expected: bool):
    assert is_permitted_request(origin, "http", "localhost:1", ("https://ours.example",)) is expected
    assert is_permitted_request(origin, "http", "localhost:1", ("*",))


def test_a_name_counts_without_its_port():
    names = {"localhost", "::1"}
    assert all(has_host_name(host, names) for host in ("localhost", "LocalHost:80", "[::1]:80", "[::1]"))
    assert not any(
        has_host_name(host, names) for host in ("", "evil.example", "localhost.evil.example:80", "[::2]")
    )
