"""Numbers as people write them where TOML writes them otherwise: decimal commas, other minus signs, units, sums."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from operator import add, mul, sub, truediv

from curveline.shapes.key_units import unit_of
from curveline.shapes.toml_fault import Slip, TomlFault
from curveline.units import to_deg, to_mm

MINUSES = "\u2010\u2011\u2012\u2013\u2014\u2212\uff0d"
"""Dashes of word processors, and the minus sign of Unicode, for which TOML has the hyphen of the keyboard."""
GROUP = "' \u00a0\u2007\u2009\u202f"
"""What may stand between groups of three digits."""
_GROUPS = rf"\d{{1,3}}(?:[{GROUP}]\d{{3}})+(?!\d)(?:[.,]\d+)?"
_BODY = rf"(?:{_GROUPS}|\d[\d_]*(?:[.,]\d+)*\.?|\.\d+)(?:[eE][+-]?\d+)?"
_SUFFIX = r"(?:[ \t\u00a0\u202f]*([^\W\d_]+(?:/[^\W\d_]+\d?)?|[%\u00b0])(?!\w)\.?)?"
_NUMBER = rf"(?<![\w.\"'])([-+{MINUSES}]?[ \t]?)({_BODY}){_SUFFIX}"
_SUM = r"(?<![\w.])(-?\d+(?:\.\d+)?)[ \t]*([*/]|[ \t][-+][ \t])[ \t]*(\d+(?:\.\d+)?)(?![\w.])"
_SAME = {"\u00b0": "deg", "degree": "deg", "degrees": "deg", "millimetres": "mm", "millimeters": "mm"}
_IN_OTHERS: Mapping[tuple[str, str], Callable[[float], float]] = {
    ("m", "mm"): to_mm,
    ("cm", "mm"): lambda value: to_mm(value) / 100.0,
    ("in", "mm"): lambda value: 25.4 * value,
    ("rad", "deg"): to_deg,
}
_OPERATORS = {"*": mul, "/": truediv, "+": add, "-": sub}
DECIMAL_COMMA = "decimals follow a point"


def number(fault: TomlFault) -> Slip | None:
    """A number that is none for TOML, at the fault."""
    match = fault.around(_NUMBER)
    if match is None:
        return None
    sign, body, suffix = match[1], match[2], match[3] or ""
    if " " in body and fault.open and fault.text[fault.open[-1]] == "[":  # these are items without a comma
        return None
    plain, reasons = _digits(body)
    if plain is None:
        return None
    if sign.strip() and sign[0] in MINUSES:
        reasons.append("the minus is that of the keyboard")
    elif sign.strip() and len(sign) > 1:
        reasons.append("the sign stands at its digits")
    start, end = match.start(1) if sign.strip() else match.start(2), match.end(2)
    text = f"{'-' if sign.strip() and sign[0] in '-' + MINUSES else ''}{plain}"
    # What follows is no unit if it is the next key.
    if suffix and not re.compile(r"[ \t]*[=.]").match(fault.text, match.end()):
        text, why = _in_the_unit(text, suffix, unit_of(fault.key_at(start)).strip())
        reasons.append(why)
        end = match.end()
    if not reasons:
        return None
    return fault.put((start, end), text, f"{fault.text[start:end]} is no number", "; ".join(reasons))


def calculation(fault: TomlFault) -> Slip | None:
    """A sum, a product or a quotient, at the fault."""
    match = fault.around(_SUM)
    if match is None:
        return None
    first, operator, second = float(match[1]), match[2].strip(), float(match[3])
    if operator == "/" and second == 0.0:
        return None
    result = f"{_OPERATORS[operator](first, second):.10g}"
    return fault.put(match.span(), result, f"{match[0]} is no number", "TOML does not calculate")


def _digits(body: str) -> tuple[str | None, list[str]]:
    """A number without a sign as TOML writes it, and what was wrong; None if nobody knows what it is."""
    reasons = []
    mantissa, mark, exponent = re.fullmatch(r"([^eE]*)([eE]?)(.*)", body).groups()  # type: ignore[union-attr]
    if re.fullmatch(rf"\d{{1,3}}([{GROUP}]\d{{3}})+([.,]\d+)?", mantissa):
        mantissa = re.sub(rf"[{GROUP}]", "", mantissa)
        reasons.append("digits stand together")
    if re.fullmatch(r"\d{1,3}(,\d{3})+\.\d+|\d{1,3}(,\d{3}){2,}", mantissa):
        mantissa = mantissa.replace(",", "")
        reasons.append("digits stand together")
    elif re.fullmatch(r"\d{1,3}(\.\d{3})+,\d+", mantissa):
        mantissa = mantissa.replace(".", "").replace(",", ".")
        reasons.append("digits stand together")
    if re.fullmatch(r"\d+,\d+", mantissa):
        thousands = f", a thousand is {mantissa.replace(',', '')}" if re.fullmatch(r"\d{1,3},\d{3}", mantissa) else ""
        reasons.append(DECIMAL_COMMA + thousands)
        mantissa = mantissa.replace(",", ".")
    if mantissa.startswith(".") or mantissa.endswith("."):
        mantissa = f"{'0' if mantissa[0] == '.' else ''}{mantissa}{'0' if mantissa[-1] == '.' else ''}"
        reasons.append("there is a digit on both sides of the point")
    if re.match(r"0[\d]", mantissa):
        mantissa = re.sub(r"^0+(?=\d)", "", mantissa)
        reasons.append("it does not begin with a 0")
    return (f"{mantissa}{mark}{exponent}", reasons) if re.fullmatch(r"\d[\d_]*(\.\d+)?", mantissa) else (None, [])


def _in_the_unit(text: str, suffix: str, unit: str) -> tuple[str, str]:
    """The number in the unit that its key names, and why it stands there alone."""
    given = _SAME.get(suffix, suffix)
    if not unit:
        return text, "it stands alone"
    if given != unit and (convert := _IN_OTHERS.get((given, unit))):
        return f"{convert(float(text)):.10g}", f"it stands alone, in {unit}"
    return text, f"it stands alone, in {unit}" if given == unit else f"it stands alone, as the number of {unit}"
