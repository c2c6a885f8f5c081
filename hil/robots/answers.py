"""Which question an answer belongs to: answers carry no number, so they are matched to questions in their order."""

from collections.abc import Sequence

from hil.safety.limits import Limits

# A question that was answered neither in its own cycle nor in the one after it is given up.
GIVEN_UP_AFTER = 2
# Answers that have not come in this share of a period are missing.
LISTEN_SHARE = 0.5


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
        self._open: tuple[int, int] | None = None  # the cycle and the time (ns) of the question without an answer
        self.missing = self.late = 0
        self.is_doubtful = False
        self._was_doubtful, self._surplus = False, 0

    def would_be_quiet(self, cycle: int, arrived: int) -> bool:
        """Whether no question may be put in a cycle before which so many answers have arrived; changes nothing."""
        return self._open is not None and arrived == 0 and cycle - self._open[0] < GIVEN_UP_AFTER

    def belated(self, arrived: int) -> None:
        """Take answers that came between two cycles, or without a question."""
        for _ in range(arrived):
            if self._surplus:
                self._surplus -= 1
            else:
                self._open = None
            if self.late < self.missing:
                self.late += 1

    def asked(self, cycle: int, time_ns: int) -> None:
        """Note that a question is put; an older one that is still open is given up."""
        self._was_doubtful, self.is_doubtful = self.is_doubtful, self._open is not None
        if self.is_doubtful:
            self._surplus = 0
        self._open = cycle, time_ns

    def match(self, times_ns: Sequence[int], until_ns: int, *, is_asked: bool) -> int | None:
        """Match the answers that came in a cycle, in their order.

        Args:
            times_ns: when each was taken from the bus.
            until_ns: until when an answer counts as in time.
            is_asked: whether the cycle has put a question.

        Returns:
            The age of the answer (ns), from its question on; None if the cycle's question was not answered in time.
        """
        if not is_asked:
            self.belated(len(times_ns))
            return None
        if self._open is None or not times_ns or times_ns[0] > until_ns:
            self.missing += 1
            self._surplus += self._was_doubtful
            self.belated(len(times_ns))
            return None
        age, self._open = times_ns[0] - self._open[1], None
        self.belated(len(times_ns) - 1)
        return age
