"""Expressions are read in many threads at a time."""

import ast
import gc
import threading
import time

from fmus.expressions import parsed_expression


class _LetsOthersRun:
    """Garbage whose end gives the processor to another thread, as CasADi's objects do, in the middle of what Python is doing."""

    def __init__(self) -> None:
        self.itself = self

    def __del__(self) -> None:
        time.sleep(0)


def test_threads_that_stand_at_different_depths_read_expressions_at_the_same_time() -> None:
    failed: list[BaseException] = []

    def read(depth: int, number: int) -> ast.Expression:
        return (
            read(depth - 1, number)
            if depth
            else parsed_expression(f"-b*tanh(v/vs{number})*(1 + max(q - {number}, 0)**2)")
        )

    def work(depth: int) -> None:
        try:
            for number in range(600):
                for _ in range(3):
                    _LetsOthersRun()
                read(depth, 1000 * depth + number)
        except BaseException as error:
            failed.append(error)

    before = gc.get_threshold()
    gc.set_threshold(50)
    try:
        threads = [threading.Thread(target=work, args=(10 * k,)) for k in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        gc.set_threshold(*before)
    assert not failed


def test_an_expression_is_read_once() -> None:
    assert parsed_expression("a + b") is parsed_expression("a + b")
