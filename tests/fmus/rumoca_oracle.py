"""rumoca's own simulator, run as `rumoca_oracle.py ROOT JOBS RESULTS`: it can crash, or take for ever.

JOBS is a JSON list of {"source" or null, "model", "stop", "points"}; RESULTS gets one JSON line a job, name -> values.
"""

import json
import sys
from pathlib import Path

import rumoca

if __name__ == "__main__":
    root, jobs, results = sys.argv[1:]
    with open(results, "w", buffering=1) as stream:
        for job in json.loads(Path(jobs).read_text()):
            if job["source"] is None:
                model = rumoca.Session().load(f"{root}/FESArm/package.mo", model=job["model"])
            else:
                model = rumoca.Session(roots=[root]).loads(job["source"], model=job["model"])
            interval = job["stop"] / job["points"]
            options = rumoca.SimConfig(rtol=1e-9, atol=1e-11, dt=interval, max_wall_seconds=20)
            result = model.simulate((0, job["stop"]), dt=interval, config=options)
            stream.write(json.dumps({name: [float(value) for value in result[name]] for name in result.names}) + "\n")
