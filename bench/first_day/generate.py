"""Fill the cache of sessions: ``python -m bench.first_day.generate --clean 200 --ordinary 200``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from bench.first_day.sessions import DEFAULT_CACHE, FIRST_SEED, all_kept, make


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m bench.first_day.generate", description=__doc__)
    parser.add_argument("--cache", type=Path, default=DEFAULT_CACHE)
    parser.add_argument("--clean", type=int, default=200)
    parser.add_argument("--ordinary", type=int, default=200)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    options = parser.parse_args(arguments)
    wanted = {"clean": options.clean, "ordinary": options.ordinary}
    seed = options.first_seed
    while lacking := tuple(k for k, n in wanted.items() if len(all_kept(options.cache, k)) < n):
        make(options.cache, seed, lacking)
        print(seed, *(f"{k} {len(all_kept(options.cache, k))}" for k in wanted), flush=True)
        seed += 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
