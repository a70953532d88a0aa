"""The kept inputs of a fuzzer (docs/security.md), once more."""

from __future__ import annotations

from pathlib import Path

from fuzz.fawkes import fawkes_seeds, fawkes_stream

CORPUS = sorted((Path(__file__).parent / "corpus").iterdir())


def test_the_corpus_is_refused_or_makes_sense():
    assert len(CORPUS) > 50
    for file in CORPUS:
        fawkes_stream(file.read_bytes())


def test_the_seeds_are_refused_or_make_sense():
    for seed in fawkes_seeds():
        fawkes_stream(seed)
