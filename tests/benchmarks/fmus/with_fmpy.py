"""The same run by FMPy, in a process of its own."""

import json
import sys


def main() -> None:
    """Run what the command line says in JSON, and print the columns."""
    from fmpy import read_model_description, simulate_fmu  # type: ignore[import-untyped]

    given = json.loads(sys.argv[1])
    try:
        description = read_model_description(given["path"], validate=False)
        others = ("String", "Binary", "Clock")
        outputs = [v.name for v in description.modelVariables if v.causality == "output" and v.type not in others]
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
        columns = {}
        for name in result.dtype.names:
            rows = result[name].astype(float).reshape(len(result), -1)
            names = [name] if result[name].ndim == 1 else [f"{name}[{k + 1}]" for k in range(rows.shape[1])]
            columns |= dict(zip(names, rows.T.tolist(), strict=True))
        answer = {"words": "ok", "columns": columns}
    except Exception as error:
        answer = {"words": " ".join(str(error).split())[:200] or type(error).__name__}
    print(json.dumps(answer))
