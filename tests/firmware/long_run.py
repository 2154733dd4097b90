"""Many random moves of unlike motors under load, and axes that break down in the middle of them.

python -m tests.firmware.long_run SEED
"""

from __future__ import annotations

import sys
from random import Random

from .rig import Motor, Rig

MOST_LOAD = 0.2
"""Part of full duty, which is the motor's torque at standstill: gears stand a quarter of it."""
LIGHT_LOAD = 0.04
"""What the friction of any of these motors holds."""


def vary(random: Random, motor: Motor) -> None:
    """Motors of one type differ, and so do gears."""
    motor.counts_per_s = random.uniform(5900, 7900)
    motor.time_constant = random.uniform(0.02, 0.045)
    motor.stiction = random.uniform(0.04, 0.12)
    motor.friction = motor.stiction * random.uniform(0.5, 0.9)


def shake(random: Random, moves: int, load: float) -> tuple[int, int]:
    """Random moves, some tiny, some broken off: the worst following error and the worst error at rest [counts].

    Once all have arrived the load is what friction can hold; a fault fails the run, for none has a reason.
    """
    worst = off = 0
    with Rig() as rig:
        for move in range(moves):
            if move % 10 == 0:
                for motor in rig.motors:
                    vary(random, motor)
            reach = random.choice((4000, 4000, 400, 40))
            target = [random.randint(-reach, reach) for _ in range(3)]
            rig.plan(target, random.choice((0, 0, 500, 4000)))
            for motor in rig.motors:
                motor.load = random.uniform(-load, load)
            rig.run(random.randint(1, 300))
            broken_off = rig.seen.settled_ms < 0 and random.random() < 0.2
            if broken_off:
                rig.brake()
            rig.arrive()
            where = f"move {move} to {target}"
            assert rig.seen.fault == 0, f"{where}: fault {rig.seen.fault} of axis {rig.seen.fault_axis}"
            assert rig.positions == (list(rig.seen.setpoint) if broken_off else target), where
            worst = max(worst, *rig.seen.worst)
            for motor in rig.motors:
                motor.load = max(-motor.friction, min(motor.friction, motor.load))
            rig.wait(200)
            off = max(off, *rig.errors)
    return worst, off


def break_down(random: Random, moves: int) -> int:
    """Random harm to random axes in the middle of moves: how many faults were found."""
    found = 0
    harms = ({"encoder": 0}, {"encoder": 2}, {"wiring": -1}, {"jump": 500}, {"counts_per_s": 1.0}, {"jump": -(2**30)})
    for _ in range(moves):
        with Rig() as rig:
            rig.plan([random.randint(-200_000, 200_000) for _ in range(3)])
            rig.run(random.randint(1, 1500))
            for name, value in random.choice(harms).items():
                setattr(random.choice(rig.motors), name, value)
            rig.arrive(400_000)
            found += rig.seen.fault != 0
            rig.brake()
            rig.wait(3000)
    return found


def main(seed: int) -> None:
    """Everything once."""
    random = Random(seed)
    worst, off = shake(random, 200, MOST_LOAD)
    found = break_down(random, 40)
    assert found == 40, f"{found} faults of 40 found"
    print(f"seed {seed}: {worst} counts behind at worst, {off} off at rest, {found} faults found")


if __name__ == "__main__":
    main(int(sys.argv[1]))
