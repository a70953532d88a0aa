"""The permitted hosts and origins of requests."""

from __future__ import annotations

import pytest

from cxbridge_web.origins import has_host_name, is_permitted_request


@pytest.mark.parametrize(
    ("origin", "expected"),
    [
        *(
            (each, True)
            for each in ("", "http://localhost:1", "HTTP://LOCALHOST:1", "https://allowed.example")
        ),
        *(
            (each, False)
            for each in ("null", "http://localhost", "https://localhost:1", "http://evil.example")
        ),
    ],
)
def test_foreign_origin_is_refused(origin: str, expected: bool):
    assert is_permitted_request(origin, "http", "localhost:1", ("https://allowed.example",)) is expected
    assert is_permitted_request(origin, "http", "localhost:1", ("*",))


def test_host_name_is_compared_without_port():
    names = {"localhost", "::1"}
    assert all(has_host_name(host, names) for host in ("localhost", "LocalHost:80", "[::1]:80", "[::1]"))
    assert not any(
        has_host_name(host, names) for host in ("", "evil.example", "localhost.evil.example:80", "[::2]")
    )
