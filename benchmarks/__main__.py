"""``python -m benchmarks [NAME...]``: run all benchmarks, or the named ones, and print their figures."""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path

known = sorted(path.stem.removeprefix("bench_") for path in Path(__file__).parent.glob("bench_*.py"))
parser = argparse.ArgumentParser(
    prog="python -m benchmarks", description="Run benchmarks, and print their figures."
)
parser.add_argument("names", metavar="NAME", nargs="*", help=f"all, or some of: {', '.join(known)}")
names = [name.removeprefix("bench_") for name in parser.parse_args().names]
if unknown := [name for name in names if name not in known]:
    parser.error(f"there is no benchmark {', '.join(unknown)}; there are: {', '.join(known)}")
for name in names or known:
    module = importlib.import_module(f"benchmarks.bench_{name}")
    print(f"== {name}: {(module.__doc__ or '').splitlines()[0]}")
    module.main()
