"""Deffunctions as the host lets CLIPS load them: with guards and questions at their beginning."""
