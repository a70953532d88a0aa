"""One module a format of recorded runs; :mod:`cxbridge.trace.formats.registry` finds the right one."""
