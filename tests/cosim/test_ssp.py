"""SSP: what is written reads back, in other tools as well; nested systems become flat; strangers' files do no harm."""

import shutil
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_fmus import small_fmu

from fmus.errors import MisfitError
from orchestrator.cosim import ComponentSpec, Connection, RunSettings, System, Value
from orchestrator.cosim.connections import wire
from orchestrator.cosim.kinds import describe
from orchestrator.cosim.load import load_system
from orchestrator.cosim.ssp import read_ssp, write_ssp

HEAD = (
    '<?xml version="1.0"?><ssd:SystemStructureDescription version="1.0" name="n" '
    'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
    'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" '
    'xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping">'
)
MILLIMETRE = (
    '<ssd:Units><ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>'
    '<ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit></ssd:Units>'
)


def pair(folder) -> System:
    """The mass on a spring, with files in a folder of their own."""
    for name in ("mass", "spring"):
        (folder / f"{name}.fmu").write_bytes(small_fmu(name).read_bytes())
    return System(
        "pair",
        {
            "mass": ComponentSpec("mass", source="mass.fmu", values={"m": Value(2.0)}),
            "spring": ComponentSpec("spring", source="spring.fmu", options={"interface": "CoSimulation"}, step=0.5),
        },
        (Connection("mass.x", "spring.x2"), Connection("mass.v", "spring.v2"), Connection("spring.f2", "mass.fa")),
        inputs={"push": ("mass.fb",)},
        outputs={"way": "mass.x"},
        run=RunSettings(start=0.0, stop=10.0, step=1e-3, master="jacobi"),
        folder=folder,
    )


def archive(path, structure: str, files: dict[str, bytes] | None = None):
    """An SSP with the mass and the spring in its resources."""
    with zipfile.ZipFile(path, "w") as out:
        out.writestr("SystemStructure.ssd", structure)
        for name in ("mass", "spring", "gain"):
            out.write(small_fmu(name), f"resources/{name}.fmu")
        for name, content in (files or {}).items():
            out.writestr(name, content)
    return path


def component(name: str, fmu: str, connectors: str = "", inside: str = "") -> str:
    kinds = {"<": "input", ">": "output", "!": "parameter"}
    listed = "".join(
        f'<ssd:Connector name="{each[1:].split(":")[0]}" kind="{kinds[each[0]]}">'
        + (f'<ssc:Real unit="{each.split(":")[1]}"/>' if ":" in each else "")
        + "</ssd:Connector>"
        for each in connectors.split()
    )
    own = f"<ssd:Connectors>{listed}</ssd:Connectors>" if listed else ""
    if fmu:
        return f'<ssd:Component name="{name}" source="resources/{fmu}.fmu">{own}{inside}</ssd:Component>'
    return f'<ssd:System name="{name}">{own}{inside}</ssd:System>'


def connection(start: str, end: str, inside: str = "", attributes: str = "") -> str:
    ends = []
    for side, address in (("start", start), ("end", end)):
        element, _, connector = address.rpartition(".")
        ends.append(f'{side}Element="{element}" ' * bool(element) + f'{side}Connector="{connector}"')
    return f"<ssd:Connection {' '.join(ends)} {attributes}>{inside}</ssd:Connection>"


def structure(system: str, rest: str = "") -> str:
    return f"{HEAD}{system}{rest}</ssd:SystemStructureDescription>"


def parameters(values: str, mapping: str = "", prefix: str = "") -> str:
    inside = f'<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>{values}</ssv:Parameters>{MILLIMETRE.replace("ssd:", "ssv:")}</ssv:ParameterSet>'
    mapped = f'<ssd:ParameterMapping><ssm:ParameterMapping version="1.0">{mapping}</ssm:ParameterMapping></ssd:ParameterMapping>'
    return (
        f'<ssd:ParameterBindings><ssd:ParameterBinding prefix="{prefix}"><ssd:ParameterValues>{inside}</ssd:ParameterValues>'
        f"{mapped if mapping else ''}</ssd:ParameterBinding></ssd:ParameterBindings>"
    )


def real(name: str, value: float, unit: str = "") -> str:
    unit = f' unit="{unit}"' if unit else ""
    return f'<ssv:Parameter name="{name}"><ssv:Real value="{value}"{unit}/></ssv:Parameter>'


def wired(system: System):
    return wire(system, {name: describe(spec, system.folder) for name, spec in system.components.items()})


def test_an_exported_system_reads_back_the_same(tmp_path):
    system = pair(tmp_path)
    again = read_ssp(write_ssp(system, tmp_path / "pair.ssp"))
    for spec in again.components.values():
        assert (again.folder / spec.source).read_bytes() == (tmp_path / f"{spec.name}.fmu").read_bytes()
    files = {name: replace(spec, source=f"{name}.fmu", units={}) for name, spec in again.components.items()}
    assert replace(again, components=files, folder=tmp_path, definitions={}, units={}) == system
    assert wired(again).notes == () == again.notes


def test_the_same_system_gives_the_same_bytes(tmp_path):
    system = pair(tmp_path)
    one, other = (write_ssp(system, tmp_path / f"{name}.ssp").read_bytes() for name in "ab")
    assert one == other


def test_factors_mappings_units_and_enumerations_survive(tmp_path):
    (tmp_path / "f.fmu").write_bytes(small_fmu("feedthrough").read_bytes())
    components = {name: ComponentSpec(name, source="f.fmu") for name in "ab"}
    components["a"] = replace(
        components["a"],
        values={
            "int32_in": Value(3),
            "boolean_in": Value(True),
            "string_in": Value("x y"),
            "enumeration_in": Value("b"),
        },
    )
    links = (
        Connection("a.float64_out", "b.float64_in", 2.0, 1.0, convert=False),
        Connection("a.boolean_out", "b.boolean_in", mapping=((False, True), (True, False))),
        Connection("a.int32_out", "b.int32_in", mapping=((1, 10),)),
        Connection("a.enumeration_out", "b.enumeration_in"),
    )
    system = System("types", components, links, folder=tmp_path)
    again = read_ssp(write_ssp(system, tmp_path / "types.ssp"))
    assert again.connections == links
    assert wired(again).starts["a"] == {"int32_in": 3, "boolean_in": True, "string_in": "x y", "enumeration_in": 2}


def test_an_export_follows_the_schema_of_ssp(tmp_path):
    from fmpy.ssp.ssd import read_ssd

    found = read_ssd(str(write_ssp(pair(tmp_path), tmp_path / "pair.ssp")))  # validates against the schema
    assert {unit.name: (unit.m, unit.s) for unit in found.units} == {"N": (1, -2), "m": (1, 0), "m/s": (1, -1)}


def test_arrays_make_it_an_ssp_2_that_follows_its_schema(tmp_path):
    import pyssp_standard
    from lxml import etree

    (tmp_path / "s.fmu").write_bytes(small_fmu("statespace", 3).read_bytes())
    components = {name: ComponentSpec(name, source="s.fmu", values={"x0": Value([1.0, 2.0, 3.0])}) for name in "ab"}
    links = (Connection("a.y[2]", "b.u[1]"),)
    system = System("arrays", components, links, folder=tmp_path)
    path = write_ssp(system, tmp_path / "arrays.ssp")
    schemas = Path(pyssp_standard.__file__).parent / "resources" / "ssp2"
    with zipfile.ZipFile(path) as packed:
        found = etree.fromstring(packed.read("SystemStructure.ssd"))
        values = etree.fromstring(packed.read("resources/parameters.ssv"))
    etree.XMLSchema(file=str(schemas / "SystemStructureDescription.xsd")).assertValid(found)
    etree.XMLSchema(file=str(schemas / "SystemStructureParameterValues.xsd")).assertValid(values)
    assert found.get("version") == values.get("version") == "2.0"
    again = read_ssp(path)
    assert again.connections == links
    assert np.array_equal(wired(again).starts["a"]["x0"], [1.0, 2.0, 3.0])


def test_nested_systems_become_flat_with_all_units_and_factors_on_the_way(tmp_path):
    inner = component(
        "inner",
        "",
        "<in:mm >out",
        "<ssd:Elements>"
        + component("mass", "mass", ">x <fa")
        + component("spring", "spring", "<x2 >f2")
        + "</ssd:Elements>"
        "<ssd:Connections>"
        + connection("in", "spring.x2", '<ssc:LinearTransformation factor="3" offset="0.5"/>')
        + connection("mass.x", "out")
        + "</ssd:Connections>",
    )
    outer = component(
        "top",
        "",
        "",
        "<ssd:Elements>"
        + inner
        + component("drive", "mass", ">x <fa")
        + "</ssd:Elements><ssd:Connections>"
        + connection("inner.in", "drive.x", '<ssc:LinearTransformation factor="2" offset="4"/>')
        + "</ssd:Connections>",
    )
    system = read_ssp(archive(tmp_path / "n.ssp", structure(outer, MILLIMETRE)))
    assert list(system.components) == ["inner_mass", "inner_spring", "drive"]
    (link,) = wired(system).links
    assert (link.source.address, link.target.address) == ("drive.x", "inner_spring.x2")
    # x m -> 1000 x mm -> 2000 x + 4 mm -> 2 x + 0.004 m -> 6 x + 0.512 m
    assert link.convert(1.0) == pytest.approx(6.512, rel=1e-14)


def test_a_signal_may_leave_the_system_and_enter_several_inputs(tmp_path):
    body = component(
        "top", "", "<u >y",
        "<ssd:Elements>" + component("a", "gain", "<u >y") + component("b", "gain", "<u >y") + "</ssd:Elements><ssd:Connections>"
        + connection("u", "a.u") + connection("b.u", "u") + connection("y", "b.y") + "</ssd:Connections>",
    )  # fmt: skip
    system = read_ssp(archive(tmp_path / "n.ssp", structure(body)))
    assert (system.inputs, system.outputs, system.connections) == ({"u": ("a.u", "b.u")}, {"y": "b.y"}, ())


def test_values_of_outer_systems_go_before_inner_ones_and_later_before_earlier(tmp_path):
    mass = component("mass", "mass", "", parameters(real("m", 1) + real("x0", 5)))
    inner = component("inner", "", "", parameters(real("mass.m", 2)) + f"<ssd:Elements>{mass}</ssd:Elements>")
    twice = parameters(real("inner.mass.m", 3)).replace("</ssd:ParameterBindings>", "") + parameters(
        real("m", 4), prefix="inner.mass."
    ).replace("<ssd:ParameterBindings>", "")
    body = component("top", "", "", twice + f"<ssd:Elements>{inner}</ssd:Elements>")
    system = read_ssp(archive(tmp_path / "n.ssp", structure(body)))
    assert wired(system).starts == {"inner_mass": {"m": 4.0, "x0": 5.0}}


def test_a_mapping_renames_and_scales_and_drops_what_it_does_not_name(tmp_path):
    entries = (
        '<ssm:MappingEntry source="length" target="mass.x0"><ssc:LinearTransformation factor="2"/></ssm:MappingEntry>'
    )
    binding = parameters(real("length", 300, "mm") + real("mass.m", 7), entries)
    body = component("top", "", "", binding + "<ssd:Elements>" + component("mass", "mass") + "</ssd:Elements>")
    system = read_ssp(archive(tmp_path / "n.ssp", structure(body)))
    assert wired(system).starts == {"mass": {"x0": pytest.approx(0.6)}}


def test_what_other_tools_write_beside_the_standard_is_understood(tmp_path):
    """Units in brackets, and empty names of elements for the system itself."""
    body = component(
        "top", "", "<u",
        parameters(real("mass.x0", 300, "[mm]")) + "<ssd:Elements>" + component("mass", "mass", "<fa") + "</ssd:Elements>"
        '<ssd:Connections><ssd:Connection startElement="" startConnector="u" endElement="mass" endConnector="fa"/>'
        "</ssd:Connections>",
    )  # fmt: skip
    system = read_ssp(archive(tmp_path / "n.ssp", structure(body)))
    assert system.inputs == {"u": ("mass.fa",)}
    assert wired(system).starts == {"mass": {"x0": pytest.approx(0.3)}}


def test_a_parameter_of_the_system_reaches_the_components_that_it_is_connected_to(tmp_path):
    body = component(
        "top", "", "!k0",
        parameters(real("k0", 5) + real("nobody", 1))
        + "<ssd:Elements>" + component("a", "spring", "!k") + component("b", "spring", "!k") + "</ssd:Elements><ssd:Connections>"
        + connection("k0", "a.k") + connection("k0", "b.k", '<ssc:LinearTransformation factor="10"/>') + "</ssd:Connections>",
    )  # fmt: skip
    system = read_ssp(archive(tmp_path / "n.ssp", structure(body)))
    assert wired(system).starts == {"a": {"k": 5.0}, "b": {"k": 50.0}}
    assert system.notes == ("parameter 'nobody' at top names no variable and is not used",)


def test_values_and_mappings_are_read_from_their_files(tmp_path):
    values = parameters(real("length", 2))
    ssv = values[values.index("<ssv:") : values.index("</ssd:ParameterValues>")]
    names = HEAD[HEAD.index("xmlns:ssd") : -1]
    files = {
        "resources/v.ssv": ssv.replace("<ssv:ParameterSet", f"<ssv:ParameterSet {names}", 1).encode(),
        "resources/v.ssm": f'<ssm:ParameterMapping {names} version="1.0"><ssm:MappingEntry source="length" target="x0"/></ssm:ParameterMapping>'.encode(),
    }
    binding = (
        '<ssd:ParameterBindings><ssd:ParameterBinding source="resources/v.ssv"><ssd:ParameterMapping source="resources/v.ssm"/>'
        "</ssd:ParameterBinding></ssd:ParameterBindings>"
    )
    body = component("top", "", "", "<ssd:Elements>" + component("mass", "mass", "", binding) + "</ssd:Elements>")
    system = read_ssp(archive(tmp_path / "n.ssp", structure(body), files))
    assert wired(system).starts == {"mass": {"x0": 2.0}}


def test_a_package_inside_a_package_is_a_nested_system(tmp_path):
    body = component("top", "", ">y", "<ssd:Elements>" + component("g", "gain", "<u >y") + "</ssd:Elements><ssd:Connections>" + connection("g.y", "y") + "</ssd:Connections>")  # fmt: skip
    inside = archive(tmp_path / "inside.ssp", structure(body)).read_bytes()
    nested = '<ssd:Component name="sub" type="application/x-ssp-package" source="resources/sub.ssp"/>'
    outer = component(
        "top", "", "",
        f"<ssd:Elements>{nested}" + component("g", "gain", "<u >y") + "</ssd:Elements><ssd:Connections>"
        + connection("sub.y", "g.u") + "</ssd:Connections>",
    )  # fmt: skip
    system = read_ssp(archive(tmp_path / "o.ssp", structure(outer), {"resources/sub.ssp": inside}))
    assert list(system.components) == ["sub_g", "g"]
    assert system.connections == (Connection("sub_g.y", "g.u"),)
    assert all((system.folder / spec.source).is_file() for spec in system.components.values())


def test_a_unit_that_only_the_structure_names_is_used(tmp_path):
    body = component(
        "top", "", "",
        "<ssd:Elements>" + component("g", "gain", "<u:m >y:mm") + component("s", "spring", "<x1") + "</ssd:Elements><ssd:Connections>"
        + connection("g.y", "s.x1") + "</ssd:Connections>",
    )  # fmt: skip
    wiring = wired(read_ssp(archive(tmp_path / "n.ssp", structure(body, MILLIMETRE))))
    assert wiring.links[0].convert(1.0) == 0.001
    wrong = body.replace('name="x1" kind="input">', 'name="x1" kind="input"><ssc:Real unit="mm"/>')
    with pytest.raises(MisfitError, match="s.x1 is in m, but the system says mm"):
        wired(read_ssp(archive(tmp_path / "w.ssp", structure(wrong, MILLIMETRE))))


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ('<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]>', "has a DOCTYPE"),
        ("not xml", "is not well-formed XML"),
    ],
)
def test_xml_with_entities_is_refused(tmp_path, body, words):
    with pytest.raises(MisfitError, match=words):
        read_ssp(archive(tmp_path / "n.ssp", body + structure("")))


def test_an_archive_that_leaves_its_folder_is_refused(tmp_path):
    with pytest.raises(MisfitError, match="not a relative path inside"):
        read_ssp(archive(tmp_path / "n.ssp", structure(""), {"../out.txt": b"x"}))
    with pytest.raises(MisfitError, match="is not an SSP: it has no SystemStructure.ssd"):
        read_ssp(Path(shutil.copy(small_fmu("mass"), tmp_path / "fmu.ssp")))


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("../../outside.fmu", "is outside the folder"),
        ("..\\..\\outside.fmu", "is outside the folder"),
        ("https://host/m.fmu", "is no relative path"),
        ("resources/none.fmu", "does not exist"),
        ("#other", "no system with the id 'other'"),
    ],
)
def test_a_source_that_cannot_be_used_is_named(tmp_path, source, words):
    body = component("top", "", "", f'<ssd:Elements><ssd:Component name="c" source="{source}"/></ssd:Elements>')
    with pytest.raises(MisfitError, match=words):
        read_ssp(archive(tmp_path / "n.ssp", structure(body)))


@pytest.mark.parametrize("source", ["resources\\decay.fmu", "resources%5Cdecay.fmu"])
def test_backslashes_in_a_source_are_slashes(tmp_path, source):
    body = component("top", "", "", f'<ssd:Elements><ssd:Component name="c" source="{source}"/></ssd:Elements>')
    file = {"resources/decay.fmu": small_fmu("decay").read_bytes()}

    system = read_ssp(archive(tmp_path / "n.ssp", structure(body), file))

    assert describe(system.components["c"], system.folder).ports[0].name == "x"


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        ([("a.y", "b.y")], "joins two sources"),
        ([("a.y", "c.u")], "names the element 'c', which is not there"),
        ([("a.y", "b.u"), ("b.y", "b.u")], "b.u is the target of two connections, from a.y and b.y"),
    ],
)
def test_a_connection_that_makes_no_sense_is_named(tmp_path, ends, words):
    links = "".join(connection(*each) for each in ends)
    body = component(
        "top", "", "",
        "<ssd:Elements>" + component("a", "gain", "<u >y") + component("b", "gain", "<u >y") + f"</ssd:Elements><ssd:Connections>{links}</ssd:Connections>",
    )  # fmt: skip
    with pytest.raises(MisfitError, match=words):
        read_ssp(archive(tmp_path / "n.ssp", structure(body)))


def test_only_systems_of_fmus_can_be_exported(tmp_path):
    system = pair(tmp_path)
    player = {**system.components, "log": ComponentSpec("log", "player", "trial.csv")}
    with pytest.raises(MisfitError, match="log cannot be in an SSP, which holds FMUs only"):
        write_ssp(replace(system, components=player), tmp_path / "x.ssp")


def test_an_ssd_beside_its_files_is_read_in_place(tmp_path):
    system = pair(tmp_path)
    with zipfile.ZipFile(write_ssp(system, tmp_path / "pair.ssp")) as packed:
        packed.extractall(tmp_path / "open")
    again = load_system(tmp_path / "open" / "SystemStructure.ssd")
    assert again.folder == tmp_path / "open"
    assert again.connections == system.connections


@pytest.mark.parametrize("name", ["a b", "ü", "50%20", "a#b?c", "x;y"])
def test_an_fmu_keeps_its_name_whatever_characters_it_has(name: str, tmp_path: Path) -> None:
    (tmp_path / f"{name}.fmu").write_bytes(small_fmu("decay").read_bytes())
    system = System("s", {"d": ComponentSpec("d", source=f"{name}.fmu")}, run=RunSettings(step=0.1), folder=tmp_path)

    again = read_ssp(write_ssp(system, tmp_path / "s.ssp"))

    assert Path(again.components["d"].source).name == f"{name}.fmu"
    assert describe(again.components["d"], again.folder).ports[0].name == "x"
