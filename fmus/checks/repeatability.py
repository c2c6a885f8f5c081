"""Equal runs give equal bits: one after the other, from a state that was kept, and in many threads at a time."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from math import isnan

from fmus.checks.instance import Instance, running
from fmus.checks.subject import STEPS, THREADS, Subject

KIND = "CoSimulation"
Rows = list[list[float]]


def check_repeatability(subject: Subject) -> Iterator[str]:
    """Two instances, stepped in turns, give the same bits."""
    with running(subject, KIND) as one, running(subject, KIND) as two:
        first: Rows = []
        second: Rows = []
        for k in range(STEPS):
            first += run_steps(one, k, k + 1)
            second += run_steps(two, k, k + 1)
    yield from _compare(subject, first, second, "two equal runs differ in {0!r}: {1!r}, {2!r}")


def check_snapshots(subject: Subject) -> Iterator[str]:
    """A run goes on in the same way after the state was taken back, and in another instance that was given its bytes."""
    interface = subject.interface(KIND)
    if not interface.canGetAndSetFMUstate:
        return
    with running(subject, KIND) as instance:
        run_steps(instance, 0, STEPS)
        state, content = instance.save(), instance.to_bytes() if interface.canSerializeFMUstate else b""
        ahead = run_steps(instance, STEPS, 2 * STEPS)
        instance.restore(state)
        again = run_steps(instance, STEPS, 2 * STEPS)
    yield from _compare(subject, ahead, again, "after its state was restored {0!r} is {2!r}; it was {1!r}")
    if interface.canSerializeFMUstate and not interface.canBeInstantiatedOnlyOncePerProcess:
        with running(subject, KIND) as other:
            other.from_bytes(content)
            copied = run_steps(other, STEPS, 2 * STEPS)
        yield from _compare(
            subject, ahead, copied, "in an instance given the state's bytes {0!r} is {2!r}; it was {1!r}"
        )


def check_threads(subject: Subject) -> Iterator[str]:
    """Instances at different times of a run, each in a thread, give what one gives alone."""
    with running(subject, KIND) as alone:
        expected = run_steps(alone, 0, STEPS + THREADS)
    with ExitStack() as stack:
        instances = [stack.enter_context(running(subject, KIND)) for _ in range(THREADS)]
        for k, instance in enumerate(instances):
            run_steps(instance, 0, k)
        with ThreadPoolExecutor(THREADS) as pool:
            results = list(pool.map(lambda k: run_steps(instances[k], k, k + STEPS), range(THREADS)))
    for k, result in enumerate(results):
        words = "with others in parallel {0!r} is {2!r}; alone {1!r}"
        found = list(_compare(subject, expected[k : k + STEPS], result, words))
        if found:
            yield found[0]
            return


def run_steps(instance: Instance, first: int, last: int) -> Rows:
    """Take steps number `first` to `last`; half-way through a run each input is moved a little."""
    subject = instance.subject
    rows = []
    for k in range(first, last):
        if k % STEPS == STEPS // 2:
            for number in subject.numbers_of("input"):
                instance.set(number, [number.moved(value) for value in instance.get([number])])
        instance.step(subject.start + k * subject.stride, subject.stride)
        rows.append(instance.get(subject.recorded))
    return rows


def _compare(subject: Subject, one: Sequence[list[float]], other: Sequence[list[float]], words: str) -> Iterator[str]:
    """The first difference, if any; NaN equals NaN."""
    names = [name for number in subject.recorded for name in number.names]
    for row, twin in zip(one, other, strict=True):
        for name, a, b in zip(names, row, twin, strict=True):
            if a != b and not (isnan(a) and isnan(b)):
                yield words.format(name, a, b)
                return
