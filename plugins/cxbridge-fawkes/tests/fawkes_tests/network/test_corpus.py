"""The stored inputs of a fuzzer (docs/security.md)."""

from __future__ import annotations

from pathlib import Path

from fuzz.fawkes import fawkes_seeds, fawkes_stream

CORPUS = sorted((Path(__file__).parent / "corpus").iterdir())


def test_corpus_is_refused_or_decoded():
    assert len(CORPUS) > 50
    for file in CORPUS:
        fawkes_stream(file.read_bytes())


def test_seeds_are_refused_or_decoded():
    for seed in fawkes_seeds():
        fawkes_stream(seed)
