"""Queries of the embedded store: conditions, order, projections and pipelines as MongoDB has them."""
