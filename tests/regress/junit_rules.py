"""Whether text is JUnit XML: by the schema beside this file, and by counting."""

from pathlib import Path

from lxml import etree

SCHEMA = etree.XMLSchema(etree.parse(str(Path(__file__).with_name("junit.xsd"))))


def junit_problems(text: str) -> list[str]:
    """What is wrong with a JUnit file; empty where nothing is."""
    root = etree.fromstring(text.encode("utf-8", "strict"))
    found = [] if SCHEMA.validate(root) else [str(error) for error in SCHEMA.error_log]
    for suite in root.iter("testsuite"):
        counted = {"tests": "testcase", "failures": "testcase/failure", "errors": "testcase/error"}
        for attribute, place in counted.items():
            if int(suite.get(attribute, "-1")) != len(suite.findall(place)):
                found.append(f"{attribute} = {suite.get(attribute)}, but there are {len(suite.findall(place))}")
    return found
