"""The command line, as ``python -m cxbridge``."""

import sys

if not sys.flags.safe_path and sys.argv[0] == __file__:
    # `python -m` puts the working directory first, but its modules must not replace installed modules
    del sys.path[0]

from cxbridge.cli.entry import main

main()
