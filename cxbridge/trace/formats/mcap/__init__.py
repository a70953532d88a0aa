"""Mcap files, cxbridge's own recordings."""

from __future__ import annotations

from cxbridge.trace.formats.base import CopyFormat, Format
from cxbridge.trace.formats.mcap.records import MAGIC

FORMATS = (
    Format(
        "mcap",
        rank=10,
        recognises=lambda _, head: head.startswith(MAGIC),
        reader="cxbridge.trace.formats.mcap.reader:McapRun",
    ),
)
RECORDING = "cxbridge.trace.formats.mcap.writer:open_recording"
COPIES = (CopyFormat("mcap", rank=10, writer="cxbridge.trace.formats.mcap.writer:open_copy"),)
