"""`curveline keys show`: what the key file knows, without the key."""

from __future__ import annotations

from curveline.cli.options import JsonOption
from curveline.cli.printing import screen


def show(json: JsonOption = False) -> None:
    """Show where the keys are, their fingerprint, and which devices are known; never the key."""
    from curveline._version import __version__
    from curveline.radio.site.key_file import default_path, read_site

    site = read_site(default_path())
    if site.remark:
        screen.note(site.remark)
    chips = {address: f"{chip:08x}" for address, chip in sorted(site.chips.items())}
    if json:
        screen.emit({"curveline": __version__, "file": str(site.path), "fingerprint": site.fingerprint, "chips": chips})
        return
    screen.result(f"{site.path}: master key {site.fingerprint} (a fingerprint, not the key)")
    screen.result(
        "\n".join(screen.table([("address", "chip"), *chips.items()], frozenset({0, 1}))) if chips else "no nodes"
    )
