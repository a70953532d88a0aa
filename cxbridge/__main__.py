"""``python -m cxbridge``."""

from cxbridge.cli.entry import main

main()
