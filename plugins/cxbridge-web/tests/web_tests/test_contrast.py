"""The contrasts of the colours of outcomes in both themes."""

from __future__ import annotations

import re

import pytest

from cxbridge_web.pages import STATIC_FOLDER

TEXT, SHAPE = 4.5, 3.0
"""The contrasts that WCAG 2.2 requires for text (1.4.3) and for shapes (1.4.11)."""

PAGE = {"light": "#ffffff", "dark": "#1d1f22"}
"""The background of panels, ``--card`` of css/app.css."""

OUTCOMES = ("formulated", "running", "completed", "failed", "rejected", "retracted")


def colours() -> dict[str, tuple[str, str]]:
    """Return the light and the dark value of each variable of the style sheet."""
    text = (STATIC_FOLDER / "css" / "outcomes.css").read_text("utf-8")
    variables = re.findall(r"--([\w-]+): light-dark\((#\w{6}), (#\w{6})\)", text)
    return {name: (light, dark) for name, light, dark in variables}


def luminance(colour: str) -> float:
    """Return the relative luminance after WCAG."""
    parts = (int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5))
    red, green, blue = (
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
    )
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(colour_a: str, colour_b: str) -> float:
    """Return the contrast of two colours."""
    darker, lighter = sorted((luminance(colour_a), luminance(colour_b)))
    return (lighter + 0.05) / (darker + 0.05)


@pytest.mark.parametrize("theme", PAGE)
@pytest.mark.parametrize("outcome", OUTCOMES)
def test_text_and_icons_of_outcomes_have_contrast(outcome, theme):
    at = list(PAGE).index(theme)
    fill, edge, ink = (colours()[f"outcome-{outcome}{part}"][at] for part in ("", "-edge", "-ink"))
    assert contrast(ink, fill) >= TEXT
    assert contrast(edge, PAGE[theme]) >= SHAPE


@pytest.mark.parametrize("theme", PAGE)
def test_failure_differs_from_success_in_luminance(theme):
    at = list(PAGE).index(theme)
    values = colours()
    assert contrast(values["outcome-failed-edge"][at], PAGE[theme]) >= TEXT  # the colour of reasons
    for outcome in ("completed", "running", "rejected", "formulated"):
        assert contrast(values["outcome-failed"][at], values[f"outcome-{outcome}"][at]) >= SHAPE, outcome
