"""Several cards may share an id, such as a stop above or below some angle: what was named is what is added."""

import json
from dataclasses import asdict
from pathlib import Path

import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.verdicts.read_back import effects_of
from orchestrator.verdicts.result import Estimate, NamedEffect
from orchestrator.versions import add_effects


def stop(variant: str) -> NamedEffect:
    values = {"k": 0.5, "qStop": 2.8}
    estimates = {f"{name}[1]": Estimate(value, "1", (value, value)) for name, value in values.items()}
    return NamedEffect("end_stop", "joint1", estimates, variant)


@pytest.mark.parametrize(("variant", "name"), [("above", "EndStopAbove"), ("below", "EndStopBelow")])
def test_a_stop_that_was_named_below_an_angle_is_added_below_it(tmp_path: Path, variant: str, name: str) -> None:
    read_back = effects_of(json.loads(json.dumps({"effects": [asdict(stop(variant))]})))
    added = add_effects(find_modelica_model("cart"), read_back, tmp_path)
    assert name in Path(added.source.file or "").read_text()
