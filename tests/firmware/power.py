"""What the KL26 makes of its supply: resets below one level, warns below another.

Addresses, bits and the reset levels' names are those of the vendor's public headers (PMC in MKL26Z4.h, kinetis.h of the
Teensy's core). From memory of the reference manual, not seen again in a public text: that the level of the reset falls
back at power-on only, that whether there is a reset may be written once, that the warning's flag stays up until it is
cleared while the supply is back, and that it may be up after power-on. The levels are the data sheet's typical ones.
"""

from __future__ import annotations

PMC_LVDSC1, PMC_LVDSC2, PMC_REGSC = 0x7D000, 0x7D001, 0x7D002
POWER_ON_MV = 1100
"""Below this there is no power, and RAM forgets."""
RESET_MV = (1600, 2560)
HYSTERESIS_MV = 60
WARNING_MV = ((1800, 1900, 2000, 2100), (2700, 2800, 2900, 3000))
"""Per level of the reset, the warning's."""
NOMINAL_MV = 3300


class Power:
    """The registers LVDSC1 and LVDSC2, and whether the chip is held in reset.

    Without `level_lasts` every reset, not only that at power-on, brings the lower level back.
    """

    def __init__(self) -> None:
        self.mv = NOMINAL_MV
        self.held = False
        self.level_lasts = True
        self._high = False
        self.reset(power_on=True)

    def reset(self, *, power_on: bool) -> None:
        """The registers as after a reset."""
        self._high = self._high and self.level_lasts and not power_on
        self._resets = True
        self._resets_written = False
        self._level = 0
        self._flag = power_on or self.is_low

    @property
    def reset_mv(self) -> int:
        """Below this the chip is reset."""
        return RESET_MV[self._high]

    @property
    def warning_mv(self) -> int:
        """Below this it warns."""
        return WARNING_MV[self._high][self._level]

    @property
    def is_low(self) -> bool:
        """Whether there is a reason to warn."""
        return self.mv < self.warning_mv

    @property
    def too_low(self) -> bool:
        """Whether there is a reason to reset the chip, or to keep it in reset."""
        margin = HYSTERESIS_MV if self.held else 0
        return self._resets and self.mv < self.reset_mv + margin

    def supply(self, mv: int) -> None:
        """The supply changes."""
        self.mv = mv
        self._flag = self._flag or self.is_low

    def read(self, offset: int) -> int:
        """A load from one of the two registers."""
        if offset == PMC_LVDSC1:
            return (0x80 if self.mv < self.reset_mv else 0) | (0x10 if self._resets else 0) | int(self._high)
        return (0x80 if self._flag else 0) | self._level

    def write(self, offset: int, value: int) -> None:
        """A store to one of them."""
        if offset == PMC_LVDSC1:
            if not self._resets_written:
                self._resets, self._resets_written = bool(value & 0x10), True
            self._high = value & 3 == 1
        else:
            self._level = value & 3
            self._flag = self._flag and not value & 0x40
        self._flag = self._flag or self.is_low
