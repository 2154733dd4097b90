"""`curveline keys show`: what the key file knows, without the key."""

from __future__ import annotations

from curveline.cli.options import JsonOption
from curveline.cli.printing import screen
from curveline.cli.terminal import TERMINAL


def show(json: JsonOption = False) -> None:
    """Show where the keys are, their fingerprint, and which devices are known; never the key."""
    from curveline.driving.site_keys import read_keys

    site = read_keys(listener=TERMINAL)
    if json:
        screen.emit(site.document())
        return
    screen.result(f"{site.path}: master key {site.fingerprint} (a fingerprint, not the key)")
    rows = [("address", "chip"), *site.rows()]
    screen.result("\n".join(screen.table(rows, frozenset({0, 1}))) if site.chips else "no nodes")
