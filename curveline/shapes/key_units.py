"""The unit that the name of a key ends in."""

from __future__ import annotations

_UNITS = {
    "mm_per_turn": "mm",
    "deg_per_turn": "deg",
    "mm_per_s2": "mm/s^2",
    "deg_per_s2": "deg/s^2",
    "mm_per_s": "mm/s",
    "deg_per_s": "deg/s",
    "g_per_m": "g/m",
    "per_m": "per m",
    "Nmm_per_deg": "N mm/deg",
    "percent": "%",
    "Nmm2": "N mm^2",
    "Nmm": "N mm",
    "px": "pixels",
    "mm": "mm",
    "deg": "deg",
    "times_s": "s",
    "GPa": "GPa",
    "C": "C",
    "N": "N",
}


def unit_of(key: str) -> str:
    """The unit in the name of a key, with a space before it; empty for a bare number."""
    for suffix, unit in _UNITS.items():
        if key.endswith(f"_{suffix}"):
            return f" {unit}"
    return ""
