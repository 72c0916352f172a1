"""Run a request again that failed in the worker: `python tests/tools/again.py FILE [--warm]`.

FILE is one that the explorer kept in the folder `faults` of the user's data. It is unpickled, which
can run code: only files that one's own explorer wrote may be given. The request runs in this
process, with its traceback on standard error should it fail again, and with kernels interpreted
where they are called with few rows, as in a worker that has just begun; --warm compiles them first.
A folder among the arguments, such as that of a study, is replaced by one of its own.
"""

from __future__ import annotations

import argparse
import importlib
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from explorer.app.session.faults import read_fault
from explorer.app.session.worker import Channel
from explorer.numerics.compiled import warm


def main() -> None:
    """Run a request again."""
    parser = argparse.ArgumentParser(prog="python tests/tools/again.py", description=__doc__)
    parser.add_argument("file", type=Path, help="a file of the folder of faults")
    parser.add_argument("--warm", action="store_true", help="with compiled kernels")
    asked = parser.parse_args()
    fault = read_fault(asked.file)
    print(f"{fault.module}.{fault.task} failed with {fault.problem}")
    task: Any = getattr(importlib.import_module(fault.module), fault.task)
    if asked.warm:
        warm()
    channel = (Channel(print, lambda: False),) if fault.is_sending else ()
    began = time.process_time()
    with TemporaryDirectory() as folder:
        arguments = [Path(folder) if isinstance(each, Path) else each for each in fault.arguments]
        value = task(*arguments, *channel)
    print(
        f"now it is done, in {time.process_time() - began:.2f} s of processor time: {value!r}"[
            :2000
        ]
    )


if __name__ == "__main__":
    main()
