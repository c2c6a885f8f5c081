"""Work on many hands: the same numbers for any number of workers, on a cluster, and after a kill."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from fmus.files import cache_folder
from orchestrator.diagnose import diagnose
from orchestrator.library.cards import effect_library
from orchestrator.measurements import MeasurementSet, load_measurements
from orchestrator.work import Cluster, Here, Resumable

IDS = ("viscous_friction", "coulomb_friction", "passive_stiffness")
PENDULUM = Path(__file__).parents[1] / "cases" / "pendulum"


@pytest.fixture(scope="module")
def swings(tmp_path_factory: pytest.TempPathFactory) -> MeasurementSet:
    """Four seconds of the catalogue's pendulum with viscous friction, from equations written out here, 50 Hz, 1 mrad noise."""
    folder = tmp_path_factory.mktemp("swings")
    m, a, inertia, g, b = 0.147585, 0.147755, 1.0912e-4, 9.81001, 2e-4
    random, times = np.random.default_rng(4), np.arange(0, 4, 0.02)
    run = solve_ivp(
        lambda t, x: [x[1], (m * g * a * np.sin(x[0]) - b * x[1]) / (inertia + m * a**2)],
        (0, 4),
        [1.5, 0],
        t_eval=times,
        rtol=1e-9,
        atol=1e-10,
    )
    rows = np.column_stack([times, run.y[0] + 1e-3 * random.standard_normal(len(times))])
    np.savetxt(folder / "swing.csv", rows, delimiter=",", header="time,theta", comments="")
    return load_measurements(folder)


def document(measurements: MeasurementSet, **options: object) -> str:
    """The JSON of a diagnosis with a small library, without its time."""
    cards = [card for card in effect_library() if card.id in IDS]
    found = diagnose(find_modelica_model("pendulum"), measurements, cards=cards, **options)
    return json.dumps({**found.to_json(), "seconds": 0})


@pytest.fixture(scope="module")
def alone(swings: MeasurementSet) -> str:
    """The document of one worker in this process."""
    return document(swings, workers=1)


def test_any_number_of_workers_gives_the_same_bytes(swings: MeasurementSet, alone: str) -> None:
    assert document(swings, workers=3) == alone


def test_finished_fits_are_not_made_again_and_another_value_of_the_data_is_another_task(
    swings: MeasurementSet, alone: str, tmp_path: Path
) -> None:
    first, second, third = (Resumable(Here(), tmp_path) for _ in range(3))

    documents = [document(swings, workers=1, work=work) for work in (first, second)]

    assert documents == [alone, alone]
    assert first.remembered == 0
    assert second.remembered == len(list(tmp_path.glob("*.pickle"))) > 0
    table = np.genfromtxt(swings.path / "swing.csv", delimiter=",", names=True)
    moved = tmp_path / "moved"
    moved.mkdir()
    rows = np.column_stack([table[name] for name in table.dtype.names])
    rows[5, 1] += 1e-9
    np.savetxt(moved / "swing.csv", rows, delimiter=",", header=",".join(table.dtype.names), comments="")
    document(load_measurements(moved), workers=1, work=third)
    assert third.remembered == 0


def test_diagnosis_that_was_killed_goes_on_and_ends_the_same(swings: MeasurementSet, tmp_path: Path) -> None:
    environment = {**os.environ, "MISFIT_CACHE": str(tmp_path / "cache")}
    command = [str(Path(sys.executable).with_name("misfit")), "diagnose", "pendulum", str(swings.path), "--json"]
    (tmp_path / "cache").mkdir()
    for name in ("systems", "dae", "compiled", "patched"):  # compiled models may be shared, finished fits may not
        (tmp_path / "cache" / name).symlink_to(cache_folder(name))
    kept = tmp_path / "cache" / "resume"
    process = subprocess.Popen([*command, str(tmp_path / "never.json"), "--quiet"], env=environment)
    while process.poll() is None and not list(kept.glob("*/*.pickle")):
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait(timeout=60)
    assert process.returncode == -signal.SIGKILL
    assert list(kept.glob("*/*.pickle"))

    for name in ("resumed", "afresh"):
        done = subprocess.run([*command, str(tmp_path / f"{name}.json"), "--quiet"], env=environment, check=False)
        assert done.returncode == 0
        assert not list(kept.glob("*/*.pickle"))  # a diagnosis that ended leaves nothing behind

    resumed, afresh = (
        {**json.loads((tmp_path / f"{name}.json").read_text()), "seconds": 0} for name in ("resumed", "afresh")
    )
    assert resumed == afresh


def test_a_dask_cluster_gives_the_same_bytes(swings: MeasurementSet, alone: str) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask is an extra")

    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None, protocol="tcp"
    ) as cluster:
        work = Cluster(cluster.scheduler_address)
        there = document(swings, workers=1, work=work)
        work.close()

    assert there == alone


def test_scheduler_that_does_not_answer_is_one_line(tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="Dask is an extra")
    command = [str(Path(sys.executable).with_name("misfit")), "diagnose", "pendulum", str(PENDULUM)]

    done = subprocess.run(
        [*command, "--scheduler", "tcp://127.0.0.1:9"], capture_output=True, text=True, check=False, timeout=120
    )

    assert done.returncode == 2
    assert "no Dask scheduler answers at tcp://127.0.0.1:9" in done.stderr
    assert "Traceback" not in done.stderr
