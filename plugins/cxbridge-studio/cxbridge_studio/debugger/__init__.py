"""The debugger of an agent's rules, and the environments that clients create; see docs/debugging.md."""
