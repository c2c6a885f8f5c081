"""System structures with prefixes that nobody declared, as public ones have them."""

from pathlib import Path

import pytest

from fmus.errors import MisfitError
from orchestrator.cosim.ssp.files import NAMESPACES, parse, with_prefixes
from orchestrator.cosim.ssp.parsing import parse_structure

SSD = """<?xml version="1.0"?>
<!-- a <comment> comes first -->
<ssd:SystemStructureDescription {declared} version="1.0" name="x"><ssd:System name="s">
<ssd:Connectors><ssd:Connector name="a" kind="input"><ssc:Real/></ssd:Connector></ssd:Connectors>
<ssd:Annotations><ssc:Annotation type="t"><oms:graphics oms:x="1"/></ssc:Annotation></ssd:Annotations>
</ssd:System></ssd:SystemStructureDescription>"""


@pytest.mark.parametrize("prefixes", [("ssd", "ssc"), ("ssd",), ()])
def test_undeclared_prefixes_mean_what_they_always_mean(tmp_path: Path, prefixes: tuple[str, ...]) -> None:
    path = tmp_path / "SystemStructure.ssd"
    path.write_text(SSD.format(declared=" ".join(f'xmlns:{p}="{NAMESPACES[p]}"' for p in prefixes)))
    root = parse_structure(path, tmp_path)
    assert root.name == "s" and [connector.name for connector in root.connectors.values()] == ["a"]


def test_a_document_that_declares_its_prefixes_stays_as_it_is() -> None:
    text = b'<a:b xmlns:a="urn:a"><c xmlns:d="urn:d" d:e="1"/></a:b>'
    assert with_prefixes(text) == text


def test_what_is_no_xml_with_namespaces_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(MisfitError, match="is not well-formed XML") as caught:
        parse(b"<a::b/>", tmp_path / "x.ssd", "ssd:SystemStructureDescription")
    assert "\n" not in str(caught.value)
