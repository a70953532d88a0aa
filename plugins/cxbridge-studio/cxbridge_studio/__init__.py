"""Tools for authors of agents: check, format, lsp, dap, why, coverage and monitor."""
