"""The rules of JUnit XML that Jenkins, GitLab and GitHub's readers share, written as a schema and checked here.

Elements, their required attributes, and what may stand below them, after the schema of Apache Ant's task <junitreport>
as Jenkins extends it (testsuites around testsuite; a testcase has at most one outcome).
"""

import xml.etree.ElementTree as ET

NUMBER, COUNT = float, int
RULES = {
    "testsuites": (
        {},
        {"name": str, "tests": COUNT, "failures": COUNT, "errors": COUNT, "time": NUMBER},
        ["testsuite"],
    ),
    "testsuite": (
        {"name": str, "tests": COUNT},
        {"failures": COUNT, "errors": COUNT, "skipped": COUNT, "time": NUMBER, "timestamp": str, "hostname": str},
        ["properties", "testcase", "system-out", "system-err"],
    ),
    "testcase": (
        {"name": str, "classname": str},
        {"time": NUMBER, "file": str, "line": COUNT},
        ["skipped", "error", "failure", "system-out", "system-err"],
    ),
    "failure": ({"message": str}, {"type": str}, []),
    "error": ({"message": str}, {"type": str}, []),
    "system-out": ({}, {}, []),
}


def junit_problems(text: str) -> list[str]:
    """What is wrong with a JUnit file; empty where nothing is."""
    root = ET.fromstring(text.encode("utf-8", "strict"))
    found = [] if root.tag == "testsuites" else [f"the root is {root.tag}"]
    found += _problems(root)
    for suite in root.iter("testsuite"):
        cases = suite.findall("testcase")
        for attribute, tag in (("failures", "failure"), ("errors", "error")):
            if int(suite.get(attribute, "0")) != sum(case.find(tag) is not None for case in cases):
                found.append(f"{attribute} = {suite.get(attribute)} is not the number of cases with {tag}")
        if int(suite.get("tests", "-1")) != len(cases):
            found.append(f"tests = {suite.get('tests')}, but there are {len(cases)} cases")
        for case in cases:
            if sum(case.find(tag) is not None for tag in ("failure", "error", "skipped")) > 1:
                found.append(f"{case.get('name')} has more than one outcome")
    return found


def _problems(element: ET.Element) -> list[str]:
    required, optional, children = RULES[element.tag]
    found = [f"{element.tag} lacks {name}" for name in required if name not in element.attrib]
    for name, value in element.attrib.items():
        kind = {**required, **optional}.get(name)
        if kind is None:
            found.append(f"{element.tag} has {name}")
            continue
        try:
            kind(value)
        except ValueError:
            found.append(f"{name} = {value!r} of {element.tag} is no {kind.__name__}")
    for child in element:
        found += _problems(child) if child.tag in children else [f"{child.tag} stands below {element.tag}"]
    return found
