"""Fuzzed design files, which are opened or refused: `python tests/tools/fuzz.py [COUNT [SEED]]`.

Valid files are mutated: bytes flipped and cut, tokens swapped, numbers, types, names, nesting
and text changed. Each file is opened as on the page, and the only error allowed is an
`ExplorerError` of one line. The number and the contents of a file that fails are printed.
"""

from __future__ import annotations

import json
import math
import random
import re
import sys
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from explorer.app.session.history import UserAction, check_drawable
from explorer.app.state.actions import open_design
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, open_state
from explorer.errors import ExplorerError
from explorer.mechanism.design_file import PRESETS, decode_design, encode_design
from explorer.numerics.compiled import warm

SEED = 4_4

PLAIN: dict[str, Any] = {"a3": [8, 5], "b1": [3, -2.5], "b2": 2, "b3": 5}
"""The fields that every design file has."""

FULL: dict[str, Any] = {
    "schema": 2,
    "name": "Großer Entwurf",
    "unit_mm": 2.5,
    "node_step": 0.5,
    **PLAIN,
    "limits": {
        "l1": [1, 20],
        "d2": [0, None],
        "d4": [0.5, 18],
        "l4": [0, None],
        "guide": [-3, 12],
        "gap": 0.25,
        "box": [[0, -12, 0], [20, 22, 18]],
        "margin": 0.1,
        "leg_radii": [0.1, 0.2, 0.3, 0.4],
        "swing": {"a1": 40.0, "b2": 90, "b4": None},
    },
    "home": {"position": [5, 3, 5], "quaternion": [0.8, 0.1, 0.2, -0.5]},
}
"""All fields of a design file of the first schema."""

MACHINE: dict[str, Any] = {
    **PLAIN,
    "schema": 2,
    "tool": {"position": [0, 0, 1.5]},
    "payload": {"mass_kg": 0.5, "centre": [0.5, 0, 0.5]},
    "gravity": [0, 1, -1],
    "actuators": {"push_n": [50, 60, 50, 60, 50, 40], "error_mm": [0, 0, 0.1, 0, 0, 0]},
    "struts": {"outer_mm": 6, "inner_mm": 4, "stress_mpa": 200},
    "guide": {"force_n": 100, "moment_nm": None},
    "tolerances": {"a3": [0.1, 0.1, 0], "guide_tilt_deg": [0.1, 0]},
    "required_box": [[4, 2, 4], [6, 4, 6]],
}
"""A design file with the fields that the second schema added."""

VALID: tuple[bytes, ...] = (
    *map(encode_design, PRESETS.values()),
    *(json.dumps(fields, ensure_ascii=False).encode() for fields in (PLAIN, FULL, MACHINE)),
)
NUMBER = re.compile(r'(?<![\w".])-?[0-9][0-9.eE+-]*')
FIELD = re.compile(r'"\w+": (\[[^\]]*\]|[^,\[{]+), ?')
TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|-?[0-9][0-9.eE+-]*|[a-zA-Z]+|[\[\]{}:,]|\s+')
NUMBERS = (
    "0", "-0.0", "1", "-1", "2", "180", "181", "0.1", "1e-12", "1e-300", "5e-324", "1e6", "1e15",
    "1e30", "1.1e30", "1e200", "1e999", "-1e999", "9007199254740993", "18446744073709551616",
    "9" * 400, "9" * 10_000, "0." + "3" * 2000, "1e99999999999999999999", "NaN", "-Infinity",
    "0x10", "1_000", "01", "+1", ".5", "1.", "1e", "--1", "1/3", "½", "１",
)  # fmt: skip
WORDS = (
    "null", "true", "false", '""', '"x"', '"1"', "[]", "{}", "[[]]", "[{}]", "[1]", "[1, 2]",
    "[1, 2, 3]", "[1, 2, 3, 4]", "[null, null]", '{"a": 1}', '"\\u0000"', '"\\ud800"', '"\\n"',
    '"../../x"', '"C:\\\\x"', '"a/b"', '"' + "n" * 101 + '"', '"' + "n" * 5000 + '"', '"\u202ex"',
    '"<script>alert(1)</script>"', '"%s%n{0}"', '"schema"', '"__class__"', '"limits"', '"l1"',
    '"b2"', '"swing"', '"home"', '"box"', '"a1"', "undefined", "'x'", "// x\n", "/* x */",
)  # fmt: skip
NOISE = (
    "\0", "\n", "\r", "\t", " ", "\u2028", "\ufeff", "é", "\u202e", "😀", "\\", '"', "\x7f",
    "\x1b[31m",
)  # fmt: skip


Mutation = Callable[[random.Random, str], str]


def fuzzed(number: int, seed: int = SEED) -> bytes:
    """Return a fuzzed file, which its number and the seed determine."""
    rng = random.Random(seed * 1_000_003 + number)
    text = rng.choice(VALID).decode()
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3, 5))):
        text = rng.choice(MUTATIONS)(rng, text)
    data = bytearray(text.encode(errors="surrogatepass"))
    if data and rng.random() < 0.1:
        for _ in range(rng.choice((1, 2, 10))):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(data)


def attempt(data: bytes) -> State | None:
    """Open a design file and compute all that the page shows; return its state, None if refused.

    Raises:
        AssertionError: The message has more than one line, or a result is not finite.
    """
    try:
        design = decode_design(data, "fuzz")
        assert decode_design(encode_design(design), "again") == design
        state = open_state(design)
        check_drawable(state)
        later = UserAction(open_design(design), "fuzz", 0.0).apply(state)
        frame = Frame(later)
        seen = frame.snapshot
        numbers = (*seen.joints, *seen.margins, *seen.volumes, seen.determinant, seen.proximity)
        assert np.isfinite(numbers).all(), "a result is not finite"
        assert 0.0 <= seen.inverse_condition <= 1.0
        assert not math.isnan(frame.free_ball.radius)
        follows = (seen.intervals, seen.modes, seen.nearest, seen.clearances)
        assert None not in (*follows, frame.performance)
    except ExplorerError as error:
        message = str(error)
        assert len(message.splitlines()) == 1, f"a message of several lines: {message!r}"
        assert 0 < len(message) < 1000, f"a message of {len(message)} characters"
        assert message.isprintable(), f"a message that is not printable: {message!r}"
        return None
    return state


def _change_number(rng: random.Random, text: str) -> str:
    """Replace one number, scale it, move it or turn its sign."""
    numbers = list(NUMBER.finditer(text))
    if not numbers:
        return text
    found = rng.choice(numbers)
    try:
        value = float(found[0])
    except ValueError:
        value = 0.0
    scaled, moved = value * 10.0 ** rng.uniform(-12.0, 12.0), rng.gauss(value, abs(value) + 1.0)
    number = rng.choice((rng.choice(NUMBERS), scaled, moved, -value))
    return f"{text[: found.start()]}{number}{text[found.end() :]}"


def _change_token(rng: random.Random, text: str) -> str:
    """Replace, drop or swap a token, or add a field."""
    # A very long text is one token, since its tokens would be too many.
    tokens = TOKEN.findall(text) if len(text) < 20_000 else [text]
    if not tokens:
        return text
    place, other = rng.randrange(len(tokens)), rng.randrange(len(tokens))
    value = rng.choice(rng.choice((NUMBERS, WORDS)))
    objects = [index for index, token in enumerate(tokens) if token == "{"]
    kind = rng.choice(("replace", "drop", "swap", "add"))
    if kind == "swap":
        tokens[place], tokens[other] = tokens[other], tokens[place]
    elif kind == "add" and objects:
        name = rng.choice(("x", "schema", "name", "node_step", "margin", "swing", "b2"))
        tokens.insert(rng.choice(objects) + 1, f'"{name}": {value}, ')
    else:
        tokens[place] = "" if kind == "drop" else value
    return "".join(tokens)


def _change_field(rng: random.Random, text: str) -> str:
    """Drop or double a field with its value and comma."""
    fields = list(FIELD.finditer(text))
    if not fields:
        return text
    field = rng.choice(fields)
    return text[: field.start()] + rng.choice((0, 2)) * field[0] + text[field.end() :]


def _change_part(rng: random.Random, text: str) -> str:
    """Repeat, drop or nest a part of the text, or add to it, without regard to its tokens."""
    start = rng.randrange(len(text) + 1)
    end = min(len(text), start + rng.choice((1, 2, 5, 20, 100)))
    part = text[start:end]
    opening, closing = rng.choice((("[", "]"), ('{"limits":', "}"), ('{"home":', "}")))
    depth = rng.choice((1, 2, 30, 1500, 30_000))
    changed = (
        part * rng.choice((0, 2, 3, 51)),
        rng.choice(rng.choice((NOISE, NUMBERS, WORDS))) + part,
        opening * depth + part + closing * depth,
    )
    return text[:start] + rng.choice(changed) + text[end:]


def _cut(rng: random.Random, text: str) -> str:
    return text[: rng.randrange(len(text) + 1)]


MUTATIONS: tuple[Mutation, ...] = (
    *[_change_number] * 9,
    *[_change_token] * 3,
    *[_change_field] * 2,
    *[_change_part] * 4,
    _cut,
)


def main(count: int = 100_000, seed: int = SEED) -> None:
    """Try fuzzed files; print the failures and how many files were opened and refused."""
    warm()
    outcomes: Counter[str] = Counter()
    for number in range(count):
        data = fuzzed(number, seed)
        try:
            outcome = "refused" if attempt(data) is None else "opened"
        except Exception as error:  # noqa: BLE001 - every other error is a failure to report
            outcome = "failed"
            print(f"{number}: {type(error).__name__}: {error}: {data[:2000]!r}")
        outcomes[outcome] += 1
    print(*(f"{count:8}  {outcome}" for outcome, count in outcomes.most_common()), sep="\n")
    sys.exit(bool(outcomes["failed"]))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
