"""Kernel that writes curves as JSON: of every coordinate the fewest digits that are read as the same number again.

The text is that of Python's `repr`, which takes several times as long as finding the curve. The digits are found as by
Raffaello Giulietti, "The Schubfach way to render doubles" (2020): a number and both ends of the interval that rounds to
it are multiplied by a power of ten known to 128 bits, whereupon whole numbers tell. Names of the formulas are his.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from curveline.kernels.forms import Counts
from curveline.kernels.kernel import leaf, shipped

LEAST, MOST = -292, 324
"""Exponents of the powers of ten by which doubles are multiplied."""
LONGEST = 24
"""Characters of a number, such as -2.2250738585072014e-308."""
PER_POINT = 2 * LONGEST + len("[, ], ")
"""Characters of a point, with what separates it from the next."""
DIGITS = 17
"""Most that a double needs."""
LARGEST_PLAIN = 16
"""Digits before the point from which on a number has an exponent."""
SMALLEST_PLAIN = -4
"""Zeros behind the point, as a negative number, from which on it has one."""

_1, _2, _4, _10, _40 = np.uint64(1), np.uint64(2), np.uint64(4), np.uint64(10), np.uint64(40)
_0, _32, _52 = np.uint64(0), np.uint64(32), np.uint64(52)
_LOW, _FRACTION, _EXPONENT = np.uint64(0xFFFFFFFF), np.uint64((1 << 52) - 1), np.uint64(0x7FF)
_HIDDEN = np.uint64(1 << 52)
_BIAS = 1075

_ZERO, _MINUS, _POINT, _COMMA, _SPACE, _OPEN, _CLOSE, _E, _PLUS = (ord(sign) for sign in "0-., []e+")


@cache
def powers_of_ten() -> NDArray[np.int64]:
    """The powers of ten from `LEAST` to `MOST`, rounded up to 128 bits: of each the upper and the lower 64."""
    words = []
    for exponent in range(LEAST, MOST + 1):
        over, under = 10 ** max(exponent, 0), 10 ** max(-exponent, 0)
        shift = 127 - ((exponent * 1741647) >> 19)
        over, under = over << max(shift, 0), under << max(-shift, 0)
        words += divmod(-(-over // under), 1 << 64)
    return np.array(words, dtype=np.uint64).view(np.int64)


@leaf
def _product(a, b):
    """The upper and the lower 64 bits of the product of two numbers of 64."""
    a1, a0, b1, b0 = a >> _32, a & _LOW, b >> _32, b & _LOW
    low, one, other = a0 * b0, a0 * b1, a1 * b0
    middle = (low >> _32) + (one & _LOW) + (other & _LOW)
    return a1 * b1 + (one >> _32) + (other >> _32) + (middle >> _32), (middle & _LOW) << _32 | (low & _LOW)


@leaf
def _rounded_to_odd(g1, g0, cp):
    """The product of a power (g1, g0) and `cp`, divided by 2^128, its last bit set where that is not exact."""
    x1, _ = _product(g0, cp)
    y1, y0 = _product(g1, cp)
    small = (y0 & _LOW) + (x1 & _LOW)
    large = (y0 >> _32) + (x1 >> _32) + (small >> _32)
    rest = (large & _LOW) << _32 | (small & _LOW)
    return (y1 + (large >> _32)) | (_1 if rest > _1 else _0)


@leaf
def shortest(bits, powers):
    """The fewest digits of a finite double above 0 with these `bits`, as a whole number, and its exponent of ten."""
    fraction, biased = bits & _FRACTION, np.int64(bits >> _52 & _EXPONENT)
    c, q = (fraction | _HIDDEN, biased - _BIAS) if biased != 0 else (fraction, np.int64(1 - _BIAS))
    if -52 <= q <= 0 and (c & ((_1 << np.uint64(-q)) - _1)) == _0:
        return c >> np.uint64(-q), np.int64(0)
    is_odd = c & _1
    is_closer = fraction == _0 and biased > 1  # to the next smaller number than to the next larger one
    k = (q * 1262611 - (524031 if is_closer else 0)) >> 22
    h = np.uint64(q + ((-k * 1741647) >> 19) + 1)
    g1, g0 = np.uint64(powers[2 * (-k - LEAST)]), np.uint64(powers[2 * (-k - LEAST) + 1])
    cb = _4 * c
    lower = _rounded_to_odd(g1, g0, (cb - (_1 if is_closer else _2)) << h) + is_odd
    vb = _rounded_to_odd(g1, g0, cb << h)
    upper = _rounded_to_odd(g1, g0, (cb + _2) << h) - is_odd
    s = vb >> _2
    if s >= _10:
        sp = s // _10
        is_inside = lower <= _40 * sp
        is_next_inside = _40 * sp + _40 <= upper
        if is_inside != is_next_inside:
            return sp + (_1 if is_next_inside else _0), k + 1
    is_inside = lower <= _4 * s
    is_next_inside = _4 * s + _4 <= upper
    if is_inside != is_next_inside:
        return s + (_1 if is_next_inside else _0), k
    middle = _4 * s + _2
    is_up = vb > middle or (vb == middle and (s & _1) != _0)
    return s + (_1 if is_up else _0), k


@leaf
def _laid_out(text, end, count, point):
    """Put a decimal point into the `count` digits that stand in `text` from `end` on; where the number then ends.

    `point` is how many of them are before it; numbers that would need many zeros get an exponent, as from `repr`.
    """
    if SMALLEST_PLAIN < point <= 0:
        shift = 2 - point
        for j in range(count - 1, -1, -1):
            text[end + shift + j] = text[end + j]
        for j in range(shift):
            text[end + j] = _POINT if j == 1 else _ZERO
        return end + shift + count
    if 0 < point <= LARGEST_PLAIN:
        for j in range(count, point + 1):
            text[end + j] = _ZERO
        count = max(count, point + 1)
        for j in range(count - 1, point - 1, -1):
            text[end + j + 1] = text[end + j]
        text[end + point] = _POINT
        return end + count + 1
    if count > 1:
        for j in range(count - 1, 0, -1):
            text[end + j + 1] = text[end + j]
        text[end + 1] = _POINT
        count += 1
    end += count
    exponent = abs(point - 1)
    text[end], text[end + 1] = _E, _MINUS if point < 1 else _PLUS
    end += 2
    if exponent >= 100:
        text[end] = _ZERO + exponent // 100
        end += 1
    text[end], text[end + 1] = _ZERO + exponent // 10 % 10, _ZERO + exponent % 10
    return end + 2


@leaf
def write_number(text, end, bits, powers):
    """Write the finite double with these `bits` into `text` from `end` on; where it then ends."""
    if bits >> np.uint64(63) != _0:
        text[end] = _MINUS
        end += 1
    bits = bits & np.uint64((1 << 63) - 1)
    if bits == _0:
        text[end], text[end + 1], text[end + 2] = _ZERO, _POINT, _ZERO
        return end + 3
    digits, exponent = shortest(bits, powers)
    while digits % _10 == _0:
        digits = digits // _10
        exponent += 1
    count = 0
    rest = digits
    while rest != _0:
        rest = rest // _10
        count += 1
    for j in range(count - 1, -1, -1):
        rest = digits // _10
        text[end + j] = _ZERO + np.int64(digits - _10 * rest)
        digits = rest
    return _laid_out(text, end, count, count + exponent)


@shipped(Counts, int, Counts, Counts)
def write_curves(bits, points, powers, room):
    """Write curves of `points` each, whose finite coordinates x, y have these `bits (2 k points,)`.

    As JSON, `[[x, y], [x, y]]`, one after the other, into the bytes of `room`: `PER_POINT` for each point and 2 for
    each curve. `powers` are those of ten. Returns at which byte each curve ends (k,).
    """
    text = room.view(np.uint8)
    words = bits.view(np.uint64)
    tens = powers.view(np.uint64)
    count = words.size // (2 * points)
    ends = np.empty(count, dtype=np.int64)
    end = 0
    for i in range(count):
        text[end] = _OPEN
        end += 1
        for j in range(points):
            place = 2 * (i * points + j)
            text[end] = _OPEN
            end = write_number(text, end + 1, words[place], tens)
            text[end], text[end + 1] = _COMMA, _SPACE
            end = write_number(text, end + 2, words[place + 1], tens)
            text[end], text[end + 1], text[end + 2] = _CLOSE, _COMMA, _SPACE
            end += 3
        text[end - 2] = _CLOSE
        end -= 1
        ends[i] = end
    return ends


def curves_as_json(curves: NDArray[np.float64]) -> list[str]:
    """Each of some curves (k, points, 2) of finite coordinates as JSON."""
    count, points, _ = curves.shape
    bits = np.ascontiguousarray(curves).reshape(-1).view(np.int64)
    room = np.empty((count * (points * PER_POINT + 2)) // 8 + 1, dtype=np.int64)
    ends = write_curves(bits, points, powers_of_ten(), room).tolist()
    text = room.view(np.uint8)[: ends[-1] if ends else 0].tobytes().decode("ascii")
    return [text[begin:end] for begin, end in zip([0, *ends], ends, strict=False)]
