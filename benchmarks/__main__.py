"""``python -m benchmarks [NAME...]``: run all benchmarks, or the named ones, and print their ratios."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

names = sys.argv[1:] or sorted(path.stem for path in Path(__file__).parent.glob("bench_*.py"))
for name in names:
    module = importlib.import_module(f"benchmarks.{'' if name.startswith('bench_') else 'bench_'}{name}")
    print(f"== {module.__name__.removeprefix('benchmarks.bench_')}: {(module.__doc__ or '').splitlines()[0]}")
    module.main()
