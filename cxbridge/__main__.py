"""``python -m cxbridge``."""

from cxbridge.cli.main import main

main()
