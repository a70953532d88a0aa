"""``python -m cxbridge``."""

import sys

if not sys.flags.safe_path and sys.argv[0] == __file__:
    del sys.path[0]  # modules in the working directory must not be imported

from cxbridge.cli.entry import main

main()
