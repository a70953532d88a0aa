"""What a fuzzer found worth keeping (docs/security.md), once more."""

from __future__ import annotations

from pathlib import Path

from fuzz.seeds import zmq_seeds
from fuzz.targets import join_message, split_message, zmq_envelope

CORPUS = sorted((Path(__file__).parent / "corpus").iterdir())


def test_the_corpus_is_refused_or_makes_sense():
    assert len(CORPUS) > 20
    for file in CORPUS:
        zmq_envelope(file.read_bytes())


def test_the_seeds_are_refused_or_make_sense():
    for seed in zmq_seeds():
        assert join_message(split_message(seed)) == seed
        zmq_envelope(seed)
