"""What it takes to speak of CAN frames in text."""

from collections.abc import Callable
from typing import NamedTuple

import can

from hil.codecs.frame import Frame

# A standard data frame, any other message that the text may stand for, or nothing.
Heard = Frame | can.Message | None


class Language(NamedTuple):
    """Pure functions of one way to write frames.

    `cut` takes complete sayings from a text and leaves the rest, which another text may complete: wherever a stream is
    split, the sayings are the same. `parse` says what one stands for, `stamp` when that was (s) if it says so.
    `write` and `write_message` make bytes; the latter raises `FrameError` for what the language cannot say.
    """

    cut: Callable[[str], tuple[list[str], str]]
    parse: Callable[[str], Heard]
    stamp: Callable[[str], float | None]
    write: Callable[[Frame], bytes]
    write_message: Callable[[can.Message], bytes]
