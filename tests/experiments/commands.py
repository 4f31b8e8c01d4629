"""Commands run as a user would, in this process."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest


def mistake(
    main: Callable[[Sequence[str]], int | None], arguments: Sequence[str], capsys: pytest.CaptureFixture[str]
) -> str:
    """What a command has to say about a mistake in its arguments: exit status 2, words, and no traceback."""
    try:
        status: object = main(arguments)
    except SystemExit as exit_:  # how the command line's parser ends
        status = exit_.code
    said = capsys.readouterr().err
    assert status == 2
    assert said
    assert "Traceback" not in said
    return said
