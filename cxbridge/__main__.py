"""The command line, as ``python -m cxbridge``."""

import sys

# `python -m` puts the working directory first in sys.path, but modules there must not replace installed
# modules. With `-P`, Python leaves the directory out; a program that runs this module by `runpy` has another
# sys.argv.
if not sys.flags.safe_path and sys.argv[0] == __file__:
    del sys.path[0]

from cxbridge.cli.entry import main

main()
