"""One comparison by pyfunnel, in a process of its own: reads four columns, prints outside points and CPU seconds as JSON.

Usage: pyfunnel_child.py FOLDER ATOLX ATOLY ROUNDS; needs nothing but pyfunnel.
"""

import csv
import json
import sys
import tempfile
import time
from array import array
from pathlib import Path

import pyfunnel


def main() -> None:
    """Print the indices of the points outside, and the least CPU seconds of the rounds."""
    folder, atolx, atoly, rounds = Path(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3]), int(sys.argv[4])
    columns = [_column(folder / name) for name in ("xr", "yr", "xt", "yt")]
    taken = []
    with tempfile.TemporaryDirectory() as out:
        for _ in range(rounds):
            began = time.process_time()
            code = pyfunnel.compareAndReport(*columns, outputDirectory=out, atolx=atolx, atoly=atoly)
            taken.append(time.process_time() - began)
        with open(Path(out) / "errors.csv") as stream:
            rows = list(csv.reader(stream))[1:]
    outside = [k for k, row in enumerate(row for row in rows if row) if float(row[1]) != 0.0]
    print(json.dumps({"code": code, "outside": outside, "cpu_s": min(taken)}))


def _column(file: Path) -> list[float]:
    numbers = array("d")
    numbers.frombytes(file.read_bytes())
    return numbers.tolist()


if __name__ == "__main__":
    main()
