"""The HTML page about a game."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from cxbridge.run.pages import write_document
from cxbridge_explore.game.judge import PRODUCTION
from cxbridge_explore.game.score import POST_GAME, Award, GameResult
from cxbridge_explore.game.timeline import Span


def write_page(result: GameResult, file: Path, command: str) -> None:
    """Write the page.

    :param command: the command that reproduces the page, to show on the page.
    :raises CxbridgeError: if the file cannot be written, or no installed package makes pages.
    """
    write_document(file, "game", f"Game of seed {result.seed}", make_document(result, command))


def make_document(result: GameResult, command: str) -> dict[str, Any]:
    """Return the values of the page as JSON; ``static/js/documents/game.js`` shows them."""
    score, timeline = result.score, result.timeline
    return {
        **result.as_dict(),
        "command": command,
        "seconds": timeline.seconds,
        "awards": [
            {**asdict(award), "second": award_second(award, timeline.seconds)} for award in score.awards
        ],
        "skills": _span_rows(timeline.skills),
        "states": _span_rows(timeline.machines),
    }


def award_second(award: Award, seconds: float) -> float:
    """Return the second of the production at which the page shows an award.

    Awards after the production are shown at its end, and awards before the production at its start.

    :param seconds: the duration of the production.
    """
    return min(award.game_time, seconds) if award.phase in (PRODUCTION, POST_GAME) else 0.0


def _span_rows(spans: Mapping[str, tuple[Span, ...]]) -> dict[str, list[dict[str, Any]]]:
    return {name: [asdict(span) for span in row] for name, row in spans.items()}
