"""``python -m cxbridge``."""

import sys

if not sys.flags.safe_path and sys.argv[0] == __file__:
    del sys.path[0]  # the current folder: modules in it are none of ours

from cxbridge.cli.entry import main

main()
