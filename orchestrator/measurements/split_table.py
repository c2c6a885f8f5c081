"""The part of a case.toml that says what is learned from and what is held out."""

from fmus.errors import MisfitError
from orchestrator.measurements.split import ByNumber, ByWindow, LastThird, Split
from orchestrator.measurements.toml_values import TomlTable
from orchestrator.measurements.wording import shown


def read_split(table: TomlTable, n_files: int) -> Split:
    """Read the split that a case.toml asks for; without any, the last third is held out.

    Of `learning` and `held_out` one may be absent: it is then the rest of the files.

    Raises:
        MisfitError: a number or window does not fit the files, or learning and held-out data overlap.
    """
    windows = (
        table.get_window("learning_window_s"),
        table.get_window("held_out_window_s"),
    )
    numbers = table.get_integers("learning"), table.get_integers("held_out")
    if windows == (None, None):
        return LastThird() if numbers == (None, None) else _by_number(table, numbers, n_files)
    if numbers != (None, None):
        raise MisfitError(
            f"{table.where}: both trial numbers (learning, held_out) and windows (learning_window_s, held_out_window_s); keep one of the two"
        )
    return _by_window(table, windows, n_files)


def _by_number(
    table: TomlTable,
    numbers: tuple[tuple[int, ...] | None, tuple[int, ...] | None],
    n_files: int,
) -> ByNumber:
    for key, chosen in zip(("learning", "held_out"), numbers, strict=True):
        for n in chosen or ():
            if not 1 <= n <= n_files:
                raise MisfitError(
                    f"{table.where}: {key} names trial {shown(n)}, but there are {n_files} files (trials 1 to {n_files}); correct the number or add the file"
                )
    everything = range(1, n_files + 1)
    learning, held_out = numbers
    if learning is None:
        learning = tuple(n for n in everything if n not in (held_out or ()))
    if held_out is None:
        held_out = tuple(n for n in everything if n not in learning)
    shared = sorted(set(learning) & set(held_out))
    if shared:
        raise MisfitError(
            f"{table.where}: trial {shared[0]} is in learning and in held_out; a held-out trial must not be learned from; remove it from one list"
        )
    if not learning:
        raise MisfitError(f"{table.where}: no trial is left for learning; put at least one number into learning")
    return ByNumber(learning, held_out)


def _by_window(
    table: TomlTable,
    windows: tuple[tuple[float, float] | None, tuple[float, float] | None],
    n_files: int,
) -> ByWindow:
    learning, held_out = windows
    if learning is None or held_out is None:
        raise MisfitError(f"{table.where}: learning_window_s and held_out_window_s belong together; give both")
    if n_files != 1:
        raise MisfitError(
            f"{table.where}: windows cut one long record, but there are {n_files} files; use learning = [...] and held_out = [...]"
        )
    if learning[0] < held_out[1] and held_out[0] < learning[1]:
        raise MisfitError(
            f"{table.where}: learning_window_s = {list(learning)} s and held_out_window_s = {list(held_out)} s overlap; held-out data must not be learned from; move one window"
        )
    return ByWindow(learning, held_out)
