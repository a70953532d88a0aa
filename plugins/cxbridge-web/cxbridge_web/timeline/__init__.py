"""A run as Chrome's trace events, which Perfetto opens: ``cxbridge trace timeline``; see docs/see.md."""
