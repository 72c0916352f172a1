"""Results that are computed on first use and kept with the value that they belong to."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Concatenate, ParamSpec, TypeVar

Owner = TypeVar("Owner")
Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

WATCH = "watch"
"""The argument that no result depends on: the function that is told the stages of its work."""

KEPT = 4
"""Number of sets of arguments whose results are kept, of each function."""


def computed_once(
    function: Callable[Concatenate[Owner, Arguments], Result],
) -> Callable[Concatenate[Owner, Arguments], Result]:
    """Return a function of a value, whose results are kept in the value.

    There is a result for each of the last `KEPT` sets of further arguments, which must be hashable
    except for `WATCH`. An error is not kept. The value must not change.
    """
    name = f"{function.__module__}.{function.__qualname__}"

    @functools.wraps(function)
    def result_of(owner: Owner, /, *args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        results = vars(owner).setdefault(name, {})
        key = args, frozenset(item for item in kwargs.items() if item[0] != WATCH)
        if key in results:
            return results[key]
        results[key] = result = function(owner, *args, **kwargs)
        if len(results) > KEPT:
            del results[next(iter(results))]
        return result

    return result_of
