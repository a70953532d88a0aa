"""Export of a run as Chrome trace events for Perfetto: ``cxbridge trace timeline``; see docs/see.md."""
