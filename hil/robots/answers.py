"""Which question an answer belongs to: answers carry no number, so they are matched to questions in their order."""

from typing import Final

from hil.codecs.frame import Timed
from hil.safety.limits import Limits

# A question that was answered neither in its own cycle nor in the one after it is given up.
GIVEN_UP_AFTER: Final = 2
# Answers that have not come in this share of a period are missing.
LISTEN_SHARE: Final = 0.5


def listen_ns(limits: Limits) -> int:
    """How long (ns) a cycle waits for answers."""
    return int(min(LISTEN_SHARE * limits.period_ns, 1e9 * limits.answer_s))


class Answers:
    """Matches the answers of one node to the questions that were put to it.

    A node answers in order, each question once. An answer that comes after the next question was put cannot be told from
    that question's own answer. So no question is put while an older one is open: in such a quiet cycle a late answer shows
    itself as what it is, and if none comes the question's answer was lost.

    After a question that was given up the next answer is doubtful (`is_doubtful`): it may be the one that was given up, as
    old as both questions are apart. What the question after it shows decides: if that is answered in time, nothing is late;
    if it is not, the doubtful answer was the old one, and one more is on its way than there are open questions.

    `missing` counts questions without an answer in time, `late` those of them that were answered later.
    """

    def __init__(self) -> None:
        self.missing = self.late = 0
        self.is_doubtful = False
        self._was_doubtful, self._surplus = False, 0
        # The cycle of the question without an answer; -1 if there is none.
        self._open = -1
        # What has arrived since the last cycle was matched: before its question, since then, and when the first of the latter came.
        self._before, self._since, self._first_ns = 0, 0, 0
        self.data, self.is_contradicted = b"", False

    def would_be_quiet(self, cycle: int, arrived: int) -> bool:
        """Whether no question may be put in a cycle before which so many answers have arrived; changes nothing."""
        return self._open >= 0 and arrived == 0 and cycle - self._open < GIVEN_UP_AFTER

    def hear(self, timed: Timed, start_ns: int, until_ns: int) -> None:
        """Take in an answer that came for a cycle, in the order in which they were taken from the bus.

        Args:
            start_ns: when the cycle began.
            until_ns: until when an answer counts as in time.
        """
        at, data = timed.time_ns, timed.frame.data
        if at <= start_ns:
            self._before += 1
            return
        self._since += 1
        if self._since == 1:
            self._first_ns, self.data, self.is_contradicted = at, data, False
        elif at <= until_ns and data != self.data:
            self.is_contradicted = True

    def is_quiet(self, cycle: int) -> bool:
        """Whether the cycle has put no question."""
        return self.would_be_quiet(cycle, self._before)

    def match(self, cycle: int, start_ns: int, until_ns: int, *, is_asked: bool) -> int | None:
        """Match what was heard for a cycle to its question, or to older ones; an older one that is still open is given up.

        Args:
            is_asked: whether the cycle has put a question.

        Returns:
            The age of the answer (ns), from its question on; None if the cycle's question was not answered in time. The
            answer is `data`, and `is_contradicted` says whether another one in time says something else.
        """
        before, since, first_ns = self._before, self._since, self._first_ns
        self._before = self._since = 0
        self._belated(before)
        if not is_asked:
            self._belated(since)
            return None
        self._was_doubtful, self.is_doubtful = self.is_doubtful, self._open >= 0
        if self.is_doubtful:
            self._surplus = 0
        self._open = cycle
        if not since or first_ns > until_ns:
            self.missing += 1
            self._surplus += self._was_doubtful
            self._belated(since)
            return None
        self._open = -1
        self._belated(since - 1)
        return first_ns - start_ns

    def _belated(self, arrived: int) -> None:
        """Take answers that came between two cycles, or without a question."""
        for _ in range(arrived):
            if self._surplus:
                self._surplus -= 1
            else:
                self._open = -1
            if self.late < self.missing:
                self.late += 1
