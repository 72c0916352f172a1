"""Fuzzed design files: opened, or refused with one line: `python tests/fuzz.py [COUNT [SEED]]`.

Valid files are mutated: bytes flipped and cut, tokens swapped, numbers, types, names, nesting
and text changed. Whatever comes of it is opened with all that opening does; nothing but an
`ExplorerError` of one line may come out. A file that fails is printed with its number, and
`--only NUMBER` tries it again by itself.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import re
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))


from collections.abc import Callable

from explorer.app.session.gestures import ByHand
from explorer.app.state.actions import Open
from explorer.app.state.drawable import check_drawable
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.errors import ExplorerError
from explorer.mechanism.design_file import PRESETS, decode_design, encode_design
from explorer.numerics.compiled import warm

SEED = 4_4
COUNT = 100_000

VALID: tuple[bytes, ...] = (
    *map(encode_design, PRESETS.values()),
    b'{"a3": [8, 5], "b1": [3, -2.5], "b2": 2, "b3": 5}',
    json.dumps(
        {
            "schema": 1,
            "name": "Großer Entwurf",
            "unit_mm": 2.5,
            "node_step": 0.5,
            "a3": [8.0, 5.0],
            "b1": [3.0, -2.5],
            "b2": 2.0,
            "b3": 5.0,
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
        },
        ensure_ascii=False,
    ).encode(),
)
TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|-?[0-9][0-9.eE+-]*|[a-zA-Z]+|[\[\]{}:,]|\s+')
NUMBERS = (
    "0", "-0.0", "1", "-1", "2", "180", "181", "0.1", "1e-9", "1e-12", "1e-13", "1e-300", "5e-324",
    "1e-400", "1e6", "1e15", "1e16", "1e30", "1.1e30", "1e40", "1e41", "1e150", "1e200", "1e308",
    "1.8e308", "1e999", "-1e999", "9007199254740993", "18446744073709551616", "9" * 400,
    "9" * 10_000, "0." + "3" * 2000, "1e99999999999999999999", "NaN", "Infinity", "-Infinity",
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


def fuzzed(number: int, seed: int = SEED) -> bytes:
    """Return one fuzzed file, always the same for the same number and seed."""
    rng = random.Random(seed * 1_000_003 + number)
    text = rng.choice(VALID).decode()
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3, 5))):
        text = rng.choice(MUTATIONS)(rng, text)
    data = bytearray(text.encode(errors="surrogatepass"))
    if rng.random() < 0.1:
        for _ in range(rng.choice((1, 2, 10))):
            _flip(rng, data)
    return bytes(data)


def attempt(data: bytes) -> State | None:
    """Open a design file with all that opening does; return its state, or None if refused.

    Raises:
        AssertionError: it is refused with more than one line, or opened with what is no number.
    """
    try:
        design = decode_design(data, "fuzz")
        assert decode_design(encode_design(design), "again") == design
        state = opened(design)
        check_drawable(state)
        later = ByHand(Open(design), "fuzz", 0.0).apply(state)
        frame = Frame(later)
        seen = frame.snapshot
        numbers = (*seen.joints, *seen.margins, *seen.volumes, seen.determinant, seen.proximity)
        assert np.isfinite(numbers).all(), "a figure is no finite number"
        assert 0.0 <= seen.inverse_condition <= 1.0
        assert not math.isnan(frame.free_ball.radius)
        follows = (seen.intervals, seen.modes, seen.nearest, seen.clearances)
        assert None not in (*follows, frame.performance, frame.travels)
    except ExplorerError as error:
        message = str(error)
        assert len(message.splitlines()) == 1, f"a message of several lines: {message!r}"
        assert 0 < len(message) < 1000, f"a message of {len(message)} characters"
        assert message.isprintable(), f"a message that cannot be shown: {message!r}"
        return None
    return state


def _replace_token(rng: random.Random, text: str) -> str:
    tokens = _tokens(text)
    if not tokens:
        return text
    place = rng.randrange(len(tokens))
    tokens[place] = rng.choice(rng.choice((NUMBERS, WORDS)))
    return "".join(tokens)


def _replace_number(rng: random.Random, text: str) -> str:
    return _change_number(rng, text, lambda _: rng.choice(NUMBERS))


def _scale_number(rng: random.Random, text: str) -> str:
    return _change_number(rng, text, lambda x: repr(x * 10.0 ** rng.uniform(-40.0, 40.0)))


def _nudge_number(rng: random.Random, text: str) -> str:
    return _change_number(rng, text, lambda x: repr(rng.gauss(x, abs(x) + 1.0)))


def _negate_number(rng: random.Random, text: str) -> str:
    return _change_number(rng, text, lambda x: repr(-x))


def _change_number(rng: random.Random, text: str, change: Callable[[float], str]) -> str:
    tokens = _tokens(text)
    places = [
        i for i, token in enumerate(tokens) if re.fullmatch(r"-?[0-9][0-9.eE+-]{0,30}", token)
    ]
    if not places:
        return text
    place = rng.choice(places)
    try:
        tokens[place] = change(float(tokens[place]))
    except (ValueError, OverflowError):
        tokens[place] = rng.choice(NUMBERS)
    return "".join(tokens)


def _swap_tokens(rng: random.Random, text: str) -> str:
    tokens = _tokens(text)
    if len(tokens) < 2:
        return text
    one, other = rng.sample(range(len(tokens)), 2)
    tokens[one], tokens[other] = tokens[other], tokens[one]
    return "".join(tokens)


def _drop_token(rng: random.Random, text: str) -> str:
    tokens = _tokens(text)
    if tokens:
        del tokens[rng.randrange(len(tokens))]
    return "".join(tokens)


def _drop_field(rng: random.Random, text: str) -> str:
    fields = list(re.finditer(r'"\w+": (\[[^\]]*\]|[^,\[{]+), ?', text))
    if not fields:
        return text
    field = rng.choice(fields)
    return text[: field.start()] + text[field.end() :]


def _repeat_part(rng: random.Random, text: str) -> str:
    start, end = _slice(rng, text)
    return text[:end] + text[start:end] * rng.choice((1, 1, 2, 50)) + text[end:]


def _repeat_field(rng: random.Random, text: str) -> str:
    fields = list(re.finditer(r'"\w+": (\[[^\]]*\]|[^,\[{]+), ?', text))
    if not fields:
        return text
    field = rng.choice(fields)
    return text[: field.start()] + field[0] + text[field.start() :]


def _cut_part(rng: random.Random, text: str) -> str:
    start, end = _slice(rng, text)
    return text[:start] + text[end:]


def _cut_off(rng: random.Random, text: str) -> str:
    return text[: rng.randrange(len(text) + 1)]


def _insert(rng: random.Random, text: str) -> str:
    place = rng.randrange(len(text) + 1)
    return text[:place] + rng.choice(rng.choice((NOISE, NUMBERS, WORDS))) + text[place:]


def _add_field(rng: random.Random, text: str) -> str:
    openings = [i for i, letter in enumerate(text) if letter == "{"]
    if not openings:
        return text
    place = rng.choice(openings) + 1
    name = rng.choice(('"x"', '"schema"', '"name"', '"node_step"', '"margin"', '"swing"', '"b2"'))
    return f"{text[:place]}{name}: {rng.choice(rng.choice((NUMBERS, WORDS)))}, {text[place:]}"


def _nest(rng: random.Random, text: str) -> str:
    opening, closing = rng.choice(
        (("[", "]"), ('{"limits":', "}"), ('{"home":', "}"), ("[[", "]]"))
    )
    depth = rng.choice((1, 2, 30, 1500, 30_000))
    start, end = _slice(rng, text)
    return text[:start] + opening * depth + text[start:end] + closing * depth + text[end:]


MUTATIONS: tuple[Callable[[random.Random, str], str], ...] = (
    _replace_token, _replace_number, _replace_number, _scale_number, _scale_number, _scale_number,
    _nudge_number, _nudge_number, _nudge_number, _negate_number, _swap_tokens, _drop_token,
    _drop_field, _repeat_part, _repeat_field, _cut_part, _cut_off, _insert, _add_field, _nest,
)  # fmt: skip


def _tokens(text: str) -> list[str]:
    # What is very long is not taken apart.
    return TOKEN.findall(text) if len(text) < 20_000 else [text]


def _slice(rng: random.Random, text: str) -> tuple[int, int]:
    start = rng.randrange(len(text) + 1)
    return start, min(len(text), start + rng.choice((1, 2, 5, 20, 100)))


def _flip(rng: random.Random, data: bytearray) -> None:
    if data:
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def main() -> int:
    """Try so many files, tell what failed, and how many were opened and refused."""
    parser = argparse.ArgumentParser(prog="python tests/fuzz.py", description=__doc__)
    parser.add_argument("count", nargs="?", type=int, default=COUNT)
    parser.add_argument("seed", nargs="?", type=int, default=SEED)
    parser.add_argument("--only", type=int, help="try this one alone, and let it fail")
    options = parser.parse_args()
    if options.only is not None:
        data = fuzzed(options.only, options.seed)
        print(data[:2000])
        print("refused" if attempt(data) is None else "opened")
        return 0
    warm()
    start = time.monotonic()
    outcomes: Counter[str] = Counter()
    slowest = (0.0, 0)
    for number in range(options.count):
        begun = time.monotonic()
        try:
            outcome = "refused" if attempt(fuzzed(number, options.seed)) is None else "opened"
        except Exception as error:  # noqa: BLE001 - whatever it is, it is a find
            outcome = f"failed: {type(error).__name__}: {error}"[:100]
            if not outcomes[outcome]:
                print(f"{number}: {outcome}")
        outcomes[outcome] += 1
        slowest = max(slowest, (time.monotonic() - begun, number))
    for outcome, count in outcomes.most_common():
        print(f"{count:8}  {outcome}")
    seconds, number = slowest
    print(f"{time.monotonic() - start:.0f} s; the slowest is {number}, {seconds:.2f} s")
    return int(any(outcome.startswith("failed") for outcome in outcomes))


if __name__ == "__main__":
    sys.exit(main())
