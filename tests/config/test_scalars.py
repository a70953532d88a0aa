"""The conversions of C and C++; the cases were checked against strtol and std::stringstream."""

from __future__ import annotations

import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cxbridge.config.scalars import ConfigType, scalar_type, to_bool, to_float, to_int, to_uint
from tests.support import many

patient = settings(max_examples=many(100, 25), deadline=None, suppress_health_check=[HealthCheck.too_slow])


@pytest.mark.parametrize(
    ("text", "type_"),
    [
        ("1", ConfigType.UINT),
        ("0x10", ConfigType.UINT),
        ("010", ConfigType.UINT),
        ("+5", ConfigType.UINT),
        (" 5", ConfigType.UINT),
        ("-0", ConfigType.UINT),
        ("5000000000", ConfigType.UINT),
        ("5 ", ConfigType.INT),  # strtol leaves the blank, a stream skips it
        ("-5", ConfigType.INT),
        ("-0x10", ConfigType.INT),
        ("08", ConfigType.FLOAT),  # no octal number
        ("1e3", ConfigType.FLOAT),
        ("1.", ConfigType.FLOAT),
        (".5", ConfigType.FLOAT),
        ("-2147483649", ConfigType.FLOAT),
        ("9223372036854775808", ConfigType.FLOAT),
        (".inf", ConfigType.FLOAT),
        ("-.INF", ConfigType.FLOAT),
        (".nan", ConfigType.FLOAT),
        ("y", ConfigType.BOOL),
        ("No", ConfigType.BOOL),
        ("TRUE", ConfigType.BOOL),
        ("off", ConfigType.BOOL),
        ("tRUE", ConfigType.STRING),
        ("1e39", ConfigType.STRING),  # more than a float32 holds
        ("0x", ConfigType.STRING),
        ("1e", ConfigType.STRING),
        ("1_000", ConfigType.STRING),
        ("inf", ConfigType.STRING),
        ("", ConfigType.STRING),
        ("null", ConfigType.STRING),
    ],
)
def test_first_matching_type_wins(text: str, type_: ConfigType) -> None:
    assert scalar_type(text) is type_


def test_values() -> None:
    assert to_uint("0x10") == 16
    assert to_uint("010") == 8
    assert to_uint("-1") is None
    assert to_int("-2147483648") == -(2**31)
    assert to_int("2147483648") is None
    assert to_float("1e3 ") == 1000.0
    assert to_float("-.inf") == -math.inf
    assert to_float("3.4028235e38") is not None
    assert to_float("3.4028236e38") is None
    assert to_bool("On") is True
    assert to_bool("oN") is None


@patient
@given(st.integers(min_value=0, max_value=2**63 - 1))
def test_unsigned_integers_in_every_base(number: int) -> None:
    assert to_uint(str(number)) == to_uint(hex(number)) == to_uint(f"0{number:o}") == number


def test_million_digits_are_no_integer() -> None:
    assert to_uint("9" * 1_000_000) is None
    assert to_int("0x" + "f" * 1_000_000) is None
