"""A Teensy LC that runs the real node program: a processor, the blocks around it, three motors.

Time is counted in core cycles at 48 MHz.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from itertools import pairwise
from random import Random
from typing import Any

from .image import Image
from .kl26 import (
    CYCLES_PER_US,
    PORT_A,
    PORT_B,
    PORT_C,
    PORT_D,
    PORT_E,
    RESET_LOW_VOLTAGE,
    RESET_POWER_ON,
    RESET_WATCHDOG,
    Kl26,
    Strayed,
)
from .motors import STEP_US, Motor
from .power import NOMINAL_MV, POWER_ON_MV
from .processor import RAM_BEGIN, RAM_END, Processor

MAIN_SLICE_US = 100
LAMP_STEADY = 255
LAMP_WINDOW_US = 1_600_000
LAMP_PAUSE_US = 700_000

PWM_PINS = (
    ((PORT_B, 0, 3, 1, 0), (PORT_B, 1, 3, 1, 1)),
    ((PORT_A, 1, 3, 2, 0), (PORT_A, 2, 3, 2, 1)),
    ((PORT_C, 1, 4, 0, 0), (PORT_C, 2, 4, 0, 1)),
)
NSLEEP, NFAULT = (PORT_D, 7), (PORT_D, 6)
CSN, CE, RADIO_IRQ = (PORT_C, 4), (PORT_C, 3), (PORT_C, 0)
TRANSLATE_SWITCH, ROD_SWITCH, BUTTON = (PORT_B, 3), (PORT_B, 2), (PORT_E, 20)
LAMP = (PORT_E, 30)


class Machine:
    """One node's electronics and mechanics; `switch_at` is where translate closes its switch, if it has one.

    Of the axes in `unplugged` (from 0) neither motor nor encoder is connected.
    """

    def __init__(self, image: Image, *, uid: tuple[int, int, int] = (1, 2, 3), seed: int = 0) -> None:
        self.image = image
        self.flash = bytearray(image.flash)
        self.chip = Kl26(self.flash, uid)
        self.motors = [Motor(), Motor(), Motor()]
        self.boots = 0
        self.watchdog_resets = 0
        self.switch_at: float | None = None
        self.unplugged: set[int] = set()
        self._random = Random(seed)
        self._radio: Any = None
        self._lamp: deque[tuple[int, int]] = deque(maxlen=64)
        self._edges: list[tuple[int, int, int]] = []
        self._cut: set[int] = set()
        self._motors_next = 0
        self._wants_reset: int | None = None
        self._held_for = 0
        self.cpu = Processor(image, self.chip)
        chip = self.chip
        chip.on_pin = self._pin_changed
        chip.on_flash = self._flash_changed
        chip.on_fresh = lambda address, length: self.cpu.write(address, bytes(self.flash[address : address + length]))
        chip.on_reset = self._ask_reset
        for pin in (NFAULT, TRANSLATE_SWITCH, ROD_SWITCH, BUTTON, RADIO_IRQ):
            chip.set_pin(*pin, 1)
        self._show_encoders()
        self.power_cycle()

    # Power and wires

    def power_cycle(self, *, ram_holds: bool = False, cause: int = RESET_POWER_ON) -> None:
        """Power off and on: motors lose their drive, the radio forgets, RAM holds anything; or, if it was short, all.

        `cause` is what the chip shows if its loader keeps the reset pin low until the power is there.
        """
        self.chip.power.supply(NOMINAL_MV)
        if not ram_holds:
            self.cpu.write(RAM_BEGIN, self._random.randbytes(RAM_END - RAM_BEGIN))
        if self._radio is not None:
            self._radio.reset()
        for motor in self.motors:
            motor.speed = 0.0
        self.reset(cause)

    def supply(self, mv: int) -> None:
        """The supply changes; low enough it resets the chip, and lets it start again once it is back."""
        power = self.chip.power
        if mv < POWER_ON_MV <= power.mv:
            self.cpu.write(RAM_BEGIN, self._random.randbytes(RAM_END - RAM_BEGIN))
            self._hold(RESET_POWER_ON)
        power.supply(mv)
        if power.held and mv >= POWER_ON_MV and not power.too_low:
            power.held = False
            self.reset(self._held_for)
        elif not power.held and power.too_low:
            self._hold(RESET_LOW_VOLTAGE)

    def _hold(self, cause: int) -> None:
        """Keep the chip in reset, with all pins open, until the supply is back."""
        self._held_for = max(cause, self._held_for if self.chip.power.held else 0)
        self.chip.reset(self._held_for)
        self.chip.power.held = True

    def reset(self, cause: int) -> None:
        """The reset that `cause` (bits of RCM_SRS0) brings about; RAM stays as it is."""
        self.boots += 1
        self.watchdog_resets += cause == RESET_WATCHDOG
        self.chip.reset(cause)
        self.chip.power.held = False
        if self._radio is not None:
            self._radio.ce = 0
        self.cpu.reset()

    def write_flash(self, address: int, data: bytes) -> None:
        """What a programmer does to the chip; a reset must follow."""
        self.flash[address : address + len(data)] = data
        self.cpu.write(address, bytes(data))

    def connect(self, radio: Any) -> None:
        """Solder a radio on: something with the pins of tests.radio.chip.Chip."""
        self._radio = radio
        self.chip.spi = radio
        radio.on_irq = lambda level: self.chip.set_pin(*RADIO_IRQ, level)
        self.chip.set_pin(*RADIO_IRQ, radio.irq)

    def set_pin(self, pin: tuple[int, int], level: int) -> None:
        """Press a button (0), or let go (1)."""
        self.chip.set_pin(*pin, level)

    def put_ends_at(self, translate: float, bias: float) -> None:
        """Fit a switch for translate and a stop for bias, in counts of the motors as built."""
        self.switch_at = translate
        self.motors[1].low = bias

    def lamp(self) -> int:
        """How often the lamp has gone on in the last pattern: 0 is dark, 255 steady."""
        if not self._lamp or self._lamp[-1][0] < self.now_us - LAMP_WINDOW_US:
            return LAMP_STEADY if self._lamp and self._lamp[-1][1] else 0
        flashes = [when for when, level in self._lamp if level]
        gaps = [later - sooner for sooner, later in pairwise(flashes)]
        pauses = [index for index, gap in enumerate(gaps) if gap > LAMP_PAUSE_US]
        return pauses[-1] - pauses[-2] if len(pauses) > 1 else -1

    def press_button(self, run: Callable[[int], None], us: int) -> None:
        """Hold the button for so long; `run` lets time pass."""
        self.set_pin(BUTTON, 0)
        run(us)
        self.set_pin(BUTTON, 1)

    def shake_encoder(self, axis: int, times: int) -> None:
        """Noise on an encoder's lines: both channels change at once, as they never do when an axis turns."""
        for _ in range(times):
            for channel in (0, 1):
                pin = PORT_D, 2 * axis + channel
                self.chip.set_pin(*pin, 1 - self.chip.levels[pin])
            self.run(100)

    def cut_encoder(self, axis: int) -> None:
        """Break both channels of an encoder: they stay as they are."""
        self._cut.add(axis)

    @property
    def counts(self) -> tuple[int, ...]:
        """Where the motors truly are."""
        return tuple(int(motor.at // 1) for motor in self.motors)

    def duty(self, axis: int) -> float:
        """What an axis' driver is told, -1 to 1, awake or not."""
        one, two = PWM_PINS[axis]
        return self.chip.duty(one) - self.chip.duty(two)

    @property
    def drivers_on(self) -> bool:
        """Whether the motor drivers are awake."""
        return bool(self.chip.output(*NSLEEP))

    @property
    def now_us(self) -> int:
        """Time since this machine was made."""
        return self.chip.now // CYCLES_PER_US

    # Time

    def run(self, us: int) -> None:
        """Let so much time pass."""
        self.run_to(self.now_us + us)

    def run_to(self, until_us: int) -> None:
        """Let time pass until then."""
        until, chip = until_us * CYCLES_PER_US, self.chip
        while chip.now < until:
            self._events()
            if self._wants_reset is not None:
                cause, self._wants_reset = self._wants_reset, None
                if cause == RESET_LOW_VOLTAGE:
                    self._hold(cause)
                else:
                    self.reset(cause)
            if chip.power.held:
                chip.now = chip.cop_fed = min(until, max(self._motors_next, chip.now + 1))
                continue
            self.cpu.turn(min(until, self._next_event()))

    def quiet_until_us(self) -> int:
        """Nothing that others could notice happens before then, unless they do something: the processor sleeps."""
        idle = self.chip.power.held or (self.cpu.asleep and not self.cpu.pending())
        return self._next_event() // CYCLES_PER_US if idle else self.now_us

    def _next_event(self) -> int:
        moments = [self._motors_next]
        if self._edges:
            moments.append(self._edges[0][0])
        if self.chip.systick_next is not None:
            moments.append(self.chip.systick_next)
        if (deadline := self.chip.cop_deadline) is not None:
            moments.append(deadline)
        return max(min(moments), self.chip.now + 1)

    def _events(self) -> None:
        chip = self.chip
        if chip.now >= self._motors_next:
            self._step_motors()
        while self._edges and self._edges[0][0] <= chip.now:
            _, axis, levels = self._edges.pop(0)
            if axis in self._cut:
                continue
            chip.set_pin(PORT_D, 2 * axis, levels & 1)
            chip.set_pin(PORT_D, 2 * axis + 1, levels >> 1)
        if chip.systick_next is not None and chip.systick_next <= chip.now:
            chip.systick_pending = True
            chip.systick_next += chip.systick_period
        if (deadline := chip.cop_deadline) is not None and chip.now >= deadline:
            self._wants_reset = RESET_WATCHDOG

    def _step_motors(self) -> None:
        cycles = STEP_US * CYCLES_PER_US
        self._motors_next = self.chip.now + cycles
        awake = self.drivers_on
        if not awake and not any(motor.speed for motor in self.motors):
            return
        for axis, motor in enumerate(self.motors):
            duty = self.duty(axis) if awake and axis not in self.unplugged else 0.0
            self._edges += [(when, axis, levels) for when, levels in motor.step(duty, self.chip.now, cycles)]
        self._edges.sort()
        if self.switch_at is not None:
            self.set_pin(TRANSLATE_SWITCH, int(self.motors[2].at > self.switch_at))

    def _show_encoders(self) -> None:
        for axis, motor in enumerate(self.motors):
            self.chip.set_pin(PORT_D, 2 * axis, motor.levels & 1)
            self.chip.set_pin(PORT_D, 2 * axis + 1, motor.levels >> 1)

    # What the blocks tell

    def _pin_changed(self, port: int, pin: int, level: int) -> None:
        if (port, pin) == LAMP:
            self._lamp.append((self.now_us, level))
            return
        if self._radio is not None and (port, pin) == CE:
            self._radio.ce = level
        elif self._radio is not None and (port, pin) == CSN:
            if level:
                self._radio.deselect()
            else:
                self._radio.select()

    def _flash_changed(self, address: int, length: int) -> None:
        if any(abs(motor.speed) > 50 for motor in self.motors):
            raise Strayed("flash is written while a motor turns")

    def _ask_reset(self, cause: int) -> None:
        self._wants_reset = cause
        self.cpu.stop()
