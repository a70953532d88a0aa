"""The tables of this plug-in; docs/plugins.md describes them."""

from __future__ import annotations

API = 1
