"""The files of SSP and their XML."""

import hashlib
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from pathlib import Path
from urllib.parse import unquote, urlsplit
from xml.parsers import expat

from fmus.archive import check_xml, extracted_once
from fmus.errors import MisfitError
from fmus.files import cache_folder
from fmus.units import BASE_UNITS, SiUnit
from orchestrator.measurements.wording import shown

STRUCTURE = "SystemStructure.ssd"


def unpacked(path: Path) -> Path:
    """Folder with the content of an SSP, kept in the cache under the hash of the file.

    Raises:
        FmuError: if the file is no SSP or not safe to unpack, see `fmus.archive`.
    """
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise MisfitError(f"{path} cannot be read: {error.strerror}; expected an SSP") from error
    return extracted_once(path, cache_folder("ssp") / digest, STRUCTURE)


def located(uri: str, beside: Path, root: Path, where: str) -> tuple[Path, str]:
    """File and fragment that a relative URI names, seen from the file `beside`; backslashes of Windows are slashes.

    Args:
        uri: relative; backslashes count as slashes.
        beside: the file that it stands in.
        root: the folder that nothing may lead out of.
        where: file and element, for messages.

    Raises:
        MisfitError: if the URI has a scheme, leads out of `root`, or names no file.
    """
    parts = urlsplit(uri)
    if parts.scheme or parts.netloc or parts.query:
        raise MisfitError(
            f"{where}: source {shown(uri)} is no relative path; copy the file beside the system structure"
        )
    if not parts.path:
        return beside, unquote(parts.fragment)
    file = (beside.parent / unquote(parts.path).replace("\\", "/")).resolve()
    if not file.is_relative_to(root.resolve()):
        raise MisfitError(f"{where}: source {shown(uri)} is outside the folder of the system structure")
    if not file.is_file():
        raise MisfitError(f"{where}: source {shown(uri)} does not exist")
    return file, unquote(parts.fragment)


_ROOT = "http://ssp-standard.org/SSP1/SystemStructure"
NAMESPACES = {
    "ssc": f"{_ROOT}Common",
    "ssd": f"{_ROOT}Description",
    "ssv": f"{_ROOT}ParameterValues",
    "ssm": f"{_ROOT}ParameterMapping",
    "ssb": f"{_ROOT}SignalDictionary",
}


def parse(content: bytes, path: Path, tag: str) -> ET.Element:
    """Parse a file whose outermost element has to be `tag`, such as `ssd:SystemStructureDescription`.

    Args:
        content: of the file.
        path: of the file, for messages.
        tag: with its prefix.

    Raises:
        MisfitError: if it is no well-formed XML, has a DOCTYPE, or holds something else.
    """
    check_xml(content, str(path))
    try:
        root = ET.fromstring(with_prefixes(content))
    except ET.ParseError as error:
        raise MisfitError(f"{path} is not well-formed XML: {error}; expected a file of SSP 1.0 or 2.0") from error
    if root.tag != qualified(tag):
        raise MisfitError(f"{path}: the outermost element is {shown(root.tag)}, expected {tag} of SSP 1.0 or 2.0")
    return root


def with_prefixes(content: bytes) -> bytes:
    """The same document with declarations of the prefixes that it uses and does not declare, as several public files do.

    The prefixes that SSP itself uses mean its namespaces, others get one of their own, so that what they mark is left alone.

    Example:
        >>> with_prefixes(b'<ssd:System><x:y/></ssd:System>')[:30]
        b'<ssd:System xmlns:ssd="http://'
    """
    used: set[str] = set()
    declared = {"xml", "xmlns"}
    places: list[int] = []

    def look(name: str, attributes: dict[str, str]) -> None:
        places.append(parser.CurrentByteIndex + 1 + len(name.encode()))
        used.update(each.partition(":")[0] for each in (name, *attributes) if ":" in each)
        declared.update(each.partition(":")[2] for each in attributes if each.startswith("xmlns:"))

    parser = expat.ParserCreate()
    parser.StartElementHandler = look
    parser.Parse(content, True)
    missing = sorted(used - declared)
    texts = "".join(f' xmlns:{p}="{NAMESPACES.get(p, f"urn:undeclared:{p}")}"' for p in missing)
    return content[: places[0]] + texts.encode() + content[places[0] :]


def qualified(tag: str) -> str:
    """Name of an element as ElementTree has it: `ssd:System` with its namespace in full."""
    prefix, _, name = tag.partition(":")
    return f"{{{NAMESPACES[prefix]}}}{name}"


def children(element: ET.Element | None, path: str) -> Iterator[ET.Element]:
    """Elements along a path such as `ssd:Elements/ssd:System`."""
    return iter(()) if element is None else iter(element.findall(path, NAMESPACES))


def required(element: ET.Element, attribute: str, where: str) -> str:
    """An attribute that has to be there.

    Args:
        element: the element.
        attribute: name of the attribute.
        where: file and element, for messages.

    Raises:
        MisfitError: if it is not.
    """
    value = element.get(attribute)
    if value is None:
        raise MisfitError(f"{where}: {local(element)} without {attribute!r}")
    return value


def number(element: ET.Element, attribute: str, default: float | None, where: str) -> float | None:
    """An attribute that is a number, or the default.

    Args:
        element: the element.
        attribute: name of the attribute.
        default: what it is where it is left out.
        where: file and element, for messages.

    Raises:
        MisfitError: if it is none.
    """
    text = element.get(attribute)
    if text is None:
        return default
    try:
        return float(text)
    except ValueError:
        raise MisfitError(f"{where}: {local(element)} with {attribute} = {shown(text)}, expected a number") from None


def truth(element: ET.Element, attribute: str) -> bool:
    """An attribute that is true or false, which is the default."""
    return element.get(attribute) in ("true", "1")


def unit_name(element: ET.Element, defined: Mapping[str, SiUnit]) -> str:
    """The unit of an element, "" without one; `[m]` is m where only that is defined, as some tools write it."""
    name = element.get("unit", "")
    bare = name.removeprefix("[").removesuffix("]")
    return bare if name not in defined and bare in defined else name


def local(element: ET.Element) -> str:
    """Name of an element without its namespace."""
    return element.tag.rpartition("}")[2]


def units(root: ET.Element, prefix: str, where: str) -> Mapping[str, SiUnit]:
    """Unit definitions of a file; `prefix` is its namespace.

    Args:
        root: the outermost element.
        prefix: of the namespace that the definitions have in this kind of file.
        where: file and element, for messages.
    """
    found = {}
    for unit in children(root, f"{prefix}:Units/ssc:Unit"):
        base = unit.find("ssc:BaseUnit", NAMESPACES)
        if base is None:
            continue
        exponents = {name: int(number(base, name, 0.0, where) or 0) for name in BASE_UNITS}
        factor, offset = number(base, "factor", 1.0, where), number(base, "offset", 0.0, where)
        assert factor is not None and offset is not None
        found[required(unit, "name", where)] = SiUnit({n: e for n, e in exponents.items() if e}, factor, offset)
    return found
