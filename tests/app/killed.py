"""Writers of a session that are killed at random moments, and the files that they leave.

Run as `python killed.py FOLDER KILLS SEED`; prints one JSON object. Writers are forked, so that
one process with all that it imported serves for many of them.
"""

from __future__ import annotations

import json
import os
import random
import signal
import struct
import sys
import time
from dataclasses import replace
from pathlib import Path

from explorer.app.session.history import History, Step
from explorer.app.state.actions import SetPosition
from explorer.app.state.state import opened
from explorer.app.storage.session_file import SessionFile
from explorer.app.storage.session_format import decode_header, decode_session
from explorer.mechanism.design_file import PRESETS

ACKNOWLEDGED = struct.Struct("qq")
# Seconds until the kill.
LONGEST = 0.04


def main(folder: Path, kills: int, seed: int) -> None:
    """Kill so many writers, and look at the folder after each."""
    chance = random.Random(seed)
    samples = histories()
    seen, saves, ends = (0, 0), 0, 0
    for number in range(kills):
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(reading)
            write_on(folder, samples, writing)
        os.close(writing)
        # Some are killed while they start, most while they write, however slow the machine is.
        sent = os.read(reading, ACKNOWLEDGED.size) if number % 5 else b""
        time.sleep(chance.uniform(0.0, LONGEST))
        os.kill(child, signal.SIGKILL)
        ends += os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL
        with os.fdopen(reading, "rb") as pipe:
            sent += pipe.read()
        # Each acknowledgement arrives whole: it is shorter than a pipe takes at once.
        acknowledged = list(ACKNOWLEDGED.iter_unpack(sent))
        saves += len(acknowledged)
        last = max([seen, *acknowledged])
        seen = max(seen, look(folder))
        assert seen >= last, f"{last} was acknowledged, {seen} is there"
    print(json.dumps({"kills": ends, "saves": saves, "number": seen[0]}))


def histories() -> list[History]:
    """Return histories of several sizes."""
    states = [opened(PRESETS["paper-optimal"])]
    for number in range(30):
        states.append(SetPosition(0, 5.0 + 0.1 * number).apply(states[-1]))
    steps = tuple(Step(0, "Move" * 50, state) for state in states)
    return [History(steps[: 1 + 10 * size]) for size in range(4)]


def write_on(folder: Path, samples: list[History], pipe: int) -> None:
    """Save sessions in a folder until the end, each known by the number of its first step."""
    store = SessionFile(folder)
    resumed = store.resume().history
    number = 0 if resumed is None else resumed.step.number
    while True:
        number += 1
        first, *others = samples[number % len(samples)].steps
        generation = store.save(History((replace(first, number=number), *others)))
        os.write(pipe, ACKNOWLEDGED.pack(number, generation))


def look(folder: Path) -> tuple[int, int]:
    """Return number and generation of the one file, which is whole; zeros without one."""
    files = [path for path in folder.glob("*") if not path.name.endswith(".lock")]
    sessions = [path for path in files if path.suffix == ".json"]
    # A scratch file lasts until the next writer comes.
    scratch = [path for path in files if path.suffix == ".part"]
    assert len(scratch) <= 1
    assert len(sessions) <= 1
    assert len(files) == len(sessions) + len(scratch), files
    if not sessions:
        return 0, 0
    data = sessions[0].read_bytes()
    generation = decode_header(data, "file").generation
    return decode_session(data, "file").step.number, generation


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
