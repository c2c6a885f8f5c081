"""The same run by FMPy, in a process of its own."""

import json
import sys


def main() -> None:
    """Run what the command line says in JSON, and print the columns."""
    from fmpy import read_model_description, simulate_fmu  # type: ignore[import-untyped]

    given = json.loads(sys.argv[1])
    try:
        description = read_model_description(given["path"], validate=False)
        numbers = ("Real", "Float64", "Float32", "Integer", "Int32", "Boolean")
        outputs = [v.name for v in description.modelVariables if v.causality == "output" and v.type in numbers]
        result = simulate_fmu(
            given["path"],
            validate=False,
            start_time=given.get("start"),
            stop_time=given.get("stop"),
            output_interval=given.get("step"),
            fmi_type=given.get("interface") or None,
            output=outputs,
            record_events=False,
            relative_tolerance=1e-8 if given.get("interface") == "ModelExchange" else None,
        )
        columns = {name: [float(x) for x in result[name]] for name in result.dtype.names if result[name].ndim == 1}
        answer = {"words": "ok", "columns": columns}
    except Exception as error:
        answer = {"words": " ".join(str(error).split())[:200] or type(error).__name__}
    print(json.dumps(answer))
