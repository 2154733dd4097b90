"""The numbers and figures of the page *What a real rod adds*.

    python docs/tools/real_rod.py limits     # when the two peaks cease to exist that the paper could not hold
    python docs/tools/real_rod.py budget     # by how much causes move the paper's 16 shapes
    python docs/tools/real_rod.py figures    # writes docs/images/real-rod-*.svg anew

Each takes up to half a minute, too long for `docs/tools/printed.py --write`: put the tables into the page by hand.
`real_rod_limits`, `real_rod_budget` and `real_rod_figures` compute them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator

import real_rod_budget
import real_rod_figures
import real_rod_limits

REPORTS: dict[str, Callable[[], Iterator[str]]] = {
    "limits": real_rod_limits.report,
    "budget": real_rod_budget.report,
    "figures": real_rod_figures.written,
}


def main() -> None:
    """Print what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=REPORTS)
    for line in REPORTS[parser.parse_args().what]():
        print(line, flush=True)


if __name__ == "__main__":
    main()
