"""Names of variables are checked against the convention that a description declares."""

from types import SimpleNamespace

import pytest

from fmus.checks.declared import check_names


def findings(*names: str, convention: str = "structured") -> list[str]:
    variables = [SimpleNamespace(name=name, sourceline=7) for name in names]
    return list(check_names(SimpleNamespace(variableNamingConvention=convention, modelVariables=variables)))


def test_structured_names_of_the_standard_are_legal() -> None:
    legal = (
        "a",
        "_a1.b",
        "a[1,2].b",
        "der(a.b[1])",
        "der(a,2)",
        "'x y'.b",
        r"'it\'s'",
        "robot.axis.'motor #234'",
        "'(a+b)*c'",
    )
    assert findings(*legal) == []


@pytest.mark.parametrize("name", ["1a", "a..b", "a[1].", "a[]", "der(der(a))", "'", "''", "a b", "", "a\n", "a-b"])
def test_others_are_named_with_their_line(name: str) -> None:
    (found,) = findings("good", name)
    assert found.startswith(f"{name!r} (line 7) is no legal name under the naming convention 'structured'")


def test_flat_names_are_free_but_for_control_characters() -> None:
    assert findings("a b-c(1)", convention="flat") == []
    assert findings("a\tb", convention="flat") == ["the name 'a\\tb' (line 7) contains a tab"]
