"""How files with cases are called; nothing is imported, since pytest asks for every file that it sees."""

from pathlib import Path

ENDING = ".regress.toml"


def is_case_file(path: Path) -> bool:
    """Whether a file holds cases, going by its name.

    Example:
        >>> is_case_file(Path("models/ball.regress.toml")), is_case_file(Path("models/arm.toml"))
        (True, False)
    """
    return path.name == "regress.toml" or path.name.endswith(ENDING)
