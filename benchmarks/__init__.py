"""Benchmarks. They import helpers of the tests.

The folders of the plug-ins' tests are put on the path here. The setting `pythonpath` in pyproject.toml does
the same for pytest.
"""

import sys
from pathlib import Path

sys.path += map(str, Path(__file__).parent.parent.glob("plugins/*/tests"))
