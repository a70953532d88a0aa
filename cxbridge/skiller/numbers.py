"""Numbers in the notation of C++'s ``std::stol``, ``std::stod`` and ``std::to_string``."""

from __future__ import annotations

import re

_INTEGER = re.compile(r"[ \t\n\v\f\r]*([+-]?[0-9]+)")
_FLOAT = re.compile(
    r"""[ \t\n\v\f\r]*(?:
        (?P<hex>[+-]?0x(?:[0-9a-f]+(?:\.[0-9a-f]*)?|\.[0-9a-f]+)(?:p[+-]?[0-9]+)?)
      | (?P<dec>[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:e[+-]?[0-9]+)?)
      | (?P<word>[+-]?(?:inf(?:inity)?|nan))
    )""",
    re.IGNORECASE | re.VERBOSE,
)
_LONG_MIN, _LONG_MAX = -(2**63), 2**63 - 1
# std::stod reports smaller numbers as out of range unless a double represents them exactly; here all smaller
# numbers but zero are out of range
_SMALLEST_NORMAL = 2.2250738585072014e-308


class NumberError(ValueError):
    """The text is not a number, or the number is out of range. The message begins with the C++ function."""


def parse_leading_integer(text: str) -> str:
    """Return the integer at the start of a text, in decimal.

    :raises NumberError: with the message ``stol`` if the text does not start with an integer;
        ``stol: out of range`` if the integer needs more than 64 bits.
    """
    match = _INTEGER.match(text)
    if match is None:
        raise NumberError("stol")
    # a number with more digits than the largest has cannot fit, and the conversion of many digits is slow
    digits = match.group(1).lstrip("+-").lstrip("0")
    if len(digits) > len(str(_LONG_MAX)):
        raise NumberError("stol: out of range")
    number = int(digits or "0") * (-1 if match.group(1).startswith("-") else 1)
    if not _LONG_MIN <= number <= _LONG_MAX:
        raise NumberError("stol: out of range")
    return str(number)


def parse_leading_float(text: str) -> str:
    """Return the number at the start of a text, with six decimals.

    :raises NumberError: with the message ``stod`` if the text does not start with a number;
        ``stod: out of range`` if the number is beyond the range of a double.
    """
    match = _FLOAT.match(text)
    if match is None:
        raise NumberError("stod")
    # std::to_string writes infinity and NaN as words of three letters
    if match["word"]:
        word = match["word"].lower()
        return ("-" if word.startswith("-") else "") + word.lstrip("+-")[:3]
    digits = match["hex"] or match["dec"]
    try:
        number = float.fromhex(digits) if match["hex"] else float(digits)
    except OverflowError:
        raise NumberError("stod: out of range") from None
    # zero is in range, whatever its exponent is
    mantissa = re.split("p" if match["hex"] else "e", digits.lower())[0]
    is_zero = not re.search(r"[1-9a-f]", mantissa)
    if number in (float("inf"), float("-inf")) or (abs(number) < _SMALLEST_NORMAL and not is_zero):
        raise NumberError("stod: out of range")
    return f"{number:.6f}"
