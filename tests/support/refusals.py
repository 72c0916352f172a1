"""One check of every refusal: the type of the error, and its message on one printable line."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from explorer import InputError


def refusal(
    action: Callable[..., object], *arguments: object, kind: type[InputError] = InputError
) -> str:
    """Return the message of the error that an action raises, known to be one printable line."""
    with pytest.raises(kind) as caught:
        action(*arguments)
    text = str(caught.value)
    assert text.isprintable()
    assert text.strip() == text != ""
    assert len(text) < 1000
    return text
