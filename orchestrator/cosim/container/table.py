"""The table of a container as C: system.c, in the terms of runtime/system.h."""

import json
import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from orchestrator.cosim.component import INTEGERS, Port
from orchestrator.cosim.container.planned import GIVEN, KINDS, NUMBERS, ContainedPart, PlannedSystem
from orchestrator.cosim.container.variables import Exposed
from orchestrator.cosim.kinds.controller import LinearController
from orchestrator.cosim.masters.not_finite import limits
from orchestrator.cosim.masters.operations import Get, Operation, Set, Settle, Shape, Solve, Step
from orchestrator.cosim.wiring import Link, Slot


def linear_data(
    controller: LinearController, size: float, array: Callable[[str, Iterable[Any]], str]
) -> dict[str, Any]:
    """The fields of `LinearData`; `array` writes numbers down and gives their name, `size` s is the step to be prepared.

    Args:
        controller: the controller.
        size: step in s that is prepared for.
        array: writes numbers of a C type down and gives their name.
    """
    a, b, c, d = controller.matrices
    fields: dict[str, Any] = {"n": a.shape[0], "m": b.shape[1], "p": c.shape[0]}
    fields |= {name: array("double", np.ravel(matrix)) for name, matrix in zip("abcd", (a, b, c, d), strict=True)}
    if controller.sample_time:
        return fields | {"sample_time": repr(controller.sample_time)}
    exact = controller.exact_step(size)
    names = ("exact_a", "exact_b")
    return (
        fields
        | {"exact_size": repr(size)}
        | {name: array("double", np.ravel(matrix)) for name, matrix in zip(names, exact, strict=True)}
    )


_OPERATIONS = {Get: "OP_READ", Set: "OP_WRITE", Step: "OP_STEP", Solve: "OP_SOLVE", Shape: "OP_SHAPE"}


def table_code(planned: PlannedSystem, variables: Sequence[Exposed], guid: str) -> str:
    """The text of system.c.

    Args:
        planned: the system, with the order of its calls.
        variables: what the container shows.
        guid: the container's identifier.
    """
    return _Table(planned, variables).code(guid)


class _Table:
    """Collects initialisers; whatever refers to something else does so by its number."""

    def __init__(self, planned: PlannedSystem, variables: Sequence[Exposed]) -> None:
        self.planned, self.variables = planned, variables
        self.numbers = {name: k for k, name in enumerate(planned.parts)}
        self.arrays: list[str] = []
        self.rows: list[str] = []
        self.links: list[str] = []
        self.pairs: list[str] = []
        self.ops: list[str] = []
        self.loops: list[str] = []

    def code(self, guid: str) -> str:
        """Everything, in the order in which C needs it."""
        planned, wiring = self.planned, self.planned.wiring
        ranges = [
            self._operations(part) for part in (planned.initial, planned.master.operations, planned.master.evaluation)
        ]
        parts = [self._part(part) for part in planned.parts.values()]
        starts = [self._start(n, v) for name in planned.parts for n, v in self._given(name)]
        seen = [self._variable(each) for each in self.variables]
        shaper = planned.master.shaper
        run = planned.system.run
        fixed = any(not part.variable_step for part in planned.parts.values())
        tables = [
            ("PartData", "parts", parts),
            ("StartData", "starts", starts),
            ("RowData", "rows", self.rows),
            ("LinkData", "links", self.links),
            ("PairData", "pairs", self.pairs),
            ("OpData", "ops", self.ops),
            ("AlgebraicLoop", "loops", self.loops),
            ("VariableData", "variables", seen),
            ("double", "signals", [_number(value) for value in self._first_values()]),
            (
                "double",
                "nominals",
                [_number(abs(s.port.nominal or 1.0)) for s in wiring.slots for _ in range(s.port.size)],
            ),
            ("char *const", "names", [_text(name) for slot in wiring.slots for name in _addresses(slot)]),
            ("char *const", "units", [_text(slot.port.unit) for slot in wiring.slots for _ in range(slot.port.size)]),
            ("char *const", "variable_names", [_text(each.name) for each in self.variables]),
        ]
        fields = {
            "guid": _text(guid),
            "step": _number(planned.step),
            "start": _number(run.start or 0.0),
            "tolerance": _number(run.tolerance or 0.0),
            "fixed_step": int(fixed),
            "extrapolate": int(shaper is not None and shaper.extrapolate),
            "smoothing": _number(shaper.smoothing if shaper is not None else 0.0),
            "n_parts": len(parts),
            "n_signals": wiring.size,
            "n_starts": len(starts),
            "n_rows": len(self.rows),
            "n_variables": len(seen),
        }
        for name, (first, count) in zip(("initial", "advance", "evaluation"), ranges, strict=True):
            fields |= {f"first_{name}": first, f"n_{name}": count}
        fields |= {name: f"system_{name}" for _, name, _ in tables}
        lines = [
            "/* The coupled system of this FMU; written by misfit. */",
            '#include "system.h"',
            "",
            "#include <stddef.h>",
            "",
        ]
        lines += self.arrays
        for kind, name, values in tables:
            lines += [
                "",
                f"static const {kind} system_{name}[] = {{",
                *(f"    {value}," for value in values or ["{0}"]),
                "};",
            ]
        lines += [
            "",
            "const SystemData misfit_system = {",
            *(f"    .{key} = {value}," for key, value in fields.items()),
            "};",
            "",
        ]
        return "\n".join(lines)

    def _array(self, kind: str, values: Iterable[Any]) -> str:
        texts = [_number(value) if kind == "double" else str(int(value)) for value in values]
        name = f"data_{len(self.arrays)}"
        self.arrays.append(f"static const {kind} {name}[] = {{{', '.join(texts or ['0'])}}};")
        return name

    def _operations(self, operations: Sequence[Operation]) -> tuple[int, int]:
        texts = [self._operation(operation) for operation in operations]
        self.ops += texts
        return len(self.ops) - len(texts), len(texts)

    def _operation(self, operation: Operation) -> str:
        fields: dict[str, Any] = {"kind": _OPERATIONS[type(operation)]}
        if isinstance(operation, Solve):
            return _initialiser(fields | {"loop": self._loop(operation)})
        assert not isinstance(operation, Settle)  # `plan_system` refuses clocks that tick
        fields["part"] = self.numbers[operation.component]
        if isinstance(operation, Step):
            return _initialiser(fields | {"every": operation.every, "pieces": operation.pieces})
        slots = [slot for slot in operation.slots if slot.port.type in NUMBERS]
        first, count = self._rows(
            operation.component, slots, not isinstance(operation, Get), not isinstance(operation, Shape)
        )
        fields |= {"first_row": first, "n_rows": count}
        if isinstance(operation, Set):
            scalars = [(link, k) for link in operation.links for k in range(len(link.sources))]
            fields["first_link"], fields["n_links"] = self._links(scalars)
        if isinstance(operation, Shape):
            interface = self.planned.parts[operation.component].interface
            fields["slopes"] = int(interface is not None and interface.interpolates_inputs)
        return _initialiser(fields)

    def _loop(self, operation: Solve) -> int:
        torn, inside = self._operations(operation.torn), self._operations(operation.inside)
        real = all(link.target.port.type == "Float64" for each in operation.torn for link in each.links)
        fields = {"path": _text(str(operation.loop)), "first_torn": torn[0], "n_torn": torn[1]}
        fields |= {"first_inside": inside[0], "n_inside": inside[1], "is_real": int(real)}
        self.loops.append(_initialiser(fields))
        return len(self.loops) - 1

    def _rows(self, component: str, slots: Sequence[Slot], is_set: bool, bounded: bool = True) -> tuple[int, int]:
        by_type: dict[str, list[Slot]] = {}
        for slot in slots:
            by_type.setdefault(slot.port.type, []).append(slot)
        first = len(self.rows)
        for kind, group in by_type.items():
            part = self.planned.parts[component]
            references = [reference for slot in group for reference in part.references(slot.port)]
            places = [place for slot in group for place in range(slot.first, slot.first + slot.port.size)]
            ranges = [limits(slot) or (-math.inf, math.inf) for slot in group for _ in range(slot.port.size)]
            fields = {
                "is_set": int(is_set),
                "part": self.numbers[component],
                "kind": KINDS[kind],
                "n_references": len(references),
                "n_values": len(places),
                "references": self._array("uint32_t", references),
                "places": self._array("int32_t", places),
            }
            if bounded and any(map(math.isfinite, np.ravel(ranges))):
                fields["lower"] = self._array("double", [low for low, _ in ranges])
                fields["upper"] = self._array("double", [high for _, high in ranges])
            self.rows.append(_initialiser(fields))
        return first, len(self.rows) - first

    def _links(self, scalars: Sequence[tuple[Link, int]]) -> tuple[int, int]:
        first = len(self.links)
        for link, k in scalars:
            transfer = link.transfer
            low, high = transfer.limits or (-math.inf, math.inf)
            fields = {
                "source": link.sources[k],
                "target": link.targets[k],
                "factor": _number(transfer.factor),
                "offset": _number(transfer.offset),
                "low": _number(low),
                "high": _number(high),
                "to_integer": int(link.target.port.type in INTEGERS),
                "keeps_others": int(link.source.port.type == link.target.port.type),
                "first_pair": len(self.pairs),
                "n_pairs": len(transfer.mapping),
            }
            self.pairs += [f"{{{_number(one)}, {_number(other)}}}" for one, other in transfer.mapping.items()]
            self.links.append(_initialiser(fields))
        return first, len(self.links) - first

    def _part(self, part: ContainedPart) -> str:
        fields: dict[str, Any] = {"name": _text(part.name)}
        if part.fmu is None:
            data = linear_data(part.described, self._piece(part.name), self._array)
            name = f"linear_{self.numbers[part.name]}"
            self.arrays.append(f"static const LinearData {name} = {_initialiser(data)};")
            return _initialiser(fields | {"version": 2, "linear": f"&{name}"})
        assert part.interface is not None
        fields |= {
            "folder": _text(part.folder),
            "identifier": _text(part.interface.identifier),
            "token": _text(part.fmu.token),
            "version": part.fmu.version,
            "early_return": int(part.early_return),
            "tolerance": _number(part.fmu.tolerance or 0.0),
        }
        return _initialiser(fields)

    def _piece(self, name: str) -> float:
        """Size of the steps that a component takes, in s."""
        step = next(each for each in self.planned.master.steps if each.component == name)
        return step.every * self.planned.step / step.pieces

    def _given(self, component: str) -> list[tuple[str, tuple[Port, Any]]]:
        ports = {port.name: port for port in self.planned.parts[component].described.ports}
        return [(component, (ports[n], value)) for n, value in self.planned.wiring.starts.get(component, {}).items()]

    def _start(self, component: str, given: tuple[Port, Any]) -> str:
        port, value = given
        if port.type not in GIVEN:
            raise MisfitError(
                f"{component}.{port.name} has a value and is of the type {port.type}, which one FMU cannot set; leave the value out, or use misfit run"
            )
        fields: dict[str, Any] = {
            "part": self.numbers[component],
            "kind": GIVEN[port.type],
            "structural": int(port.causality == "structuralParameter"),
            "n_values": port.size,
            "reference": (self.planned.parts[component].references(port) or [0])[0],
        }
        if port.type == "String":
            return _initialiser(fields | {"text": _text(str(value))})
        return _initialiser(fields | {"values": self._array("double", np.ravel(np.asarray(value, dtype=float)))})

    def _first_values(self) -> list[float]:
        """Values of all signals before anything is computed."""
        values = [0.0] * self.planned.wiring.size
        for slot in self.planned.wiring.slots:
            start = self.planned.wiring.starts.get(slot.component, {}).get(slot.port.name, slot.port.start)
            if start is not None and slot.port.type in NUMBERS:
                values[slot.first : slot.first + slot.port.size] = np.ravel(np.asarray(start, dtype=float)).tolist()
        return values

    def _variable(self, variable: Exposed) -> str:
        port = variable.port
        fields: dict[str, Any] = {"access": variable.access, "kind": KINDS[port.type], "settable": variable.settable}
        fields["place"] = variable.place
        if variable.access in ("OF_INPUT", "OF_SYSTEM_OUTPUT"):
            fields["first_link"], fields["n_links"] = self._links(variable.links)
        if variable.written:
            found = [self._rows(slot.component, [slot], True) for slot in variable.written]
            fields |= {"first_row": found[0][0], "n_rows": len(found)}
        if variable.component in self.planned.parts:
            part = self.planned.parts[variable.component]
            references = part.references(port)
            fields |= {"part": self.numbers[variable.component]}
            if len(references) > 1:  # of a controller, whose elements stand for themselves
                fields |= {"n_elements": 1, "reference": references[variable.element]}
            else:
                fields |= {"element": variable.element, "n_elements": port.size, "reference": references[0]}
        return _initialiser(fields)


def _addresses(slot: Slot) -> list[str]:
    return [f"{slot.component}.{each}" if slot.component else each for each in slot.port.elements]


def _initialiser(fields: Mapping[str, Any]) -> str:
    return "{" + ", ".join(f".{key} = {value}" for key, value in fields.items()) + "}"


def _number(value: float) -> str:
    """A double that C reads back as the same one; without a bound, the largest there is."""
    value = float(value)
    return repr(value if math.isfinite(value) else math.copysign(sys.float_info.max, value))


def _text(text: str) -> str:
    """A string literal; octal escapes end by themselves, unlike hexadecimal ones."""
    plain = json.dumps("".join(chr(byte) if 32 <= byte < 127 else "\0" for byte in text.encode()))
    parts = plain.split("\\u0000")
    odd = [byte for byte in text.encode() if not 32 <= byte < 127]
    return parts[0] + "".join(f"\\{byte:03o}{part}" for byte, part in zip(odd, parts[1:], strict=True))
