"""A child may be told to do without packages: python-can takes pandas along, which no robot and no watchdog needs."""

from fmus.children import child_environment, python_command, run_child


def test_a_child_cannot_import_what_it_is_told_to_do_without() -> None:
    command = python_command("json.tool", "--help")

    assert run_child(command, environment=child_environment()).returncode == 0
    refused = run_child(command, environment=child_environment(MISFIT_WITHOUT="argparse"))
    assert b"import of argparse halted" in refused.stderr
