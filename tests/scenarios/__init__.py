"""Tests of the scenarios: our own files, run to their end and compared with recordings."""
