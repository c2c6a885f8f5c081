"""`misfit blocks`: what files say of blocks, and how far two of them agree."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from orchestrator.cli.blocks import blocks
from orchestrator.gp.block import Block, Output, Term
from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import condition
from orchestrator.gp.saved import read_block, write_block


def friction(folder: Path, name: str, damping: float) -> Path:
    w = np.linspace(-3.0, 3.0, 15)
    latents = {"f": Latent(SquaredExponential(4.0, (2.0,)))}
    seen = (observe("bench", w, "f", -damping * w, 0.05),)
    about = {
        "model": "drive",
        "model_version": "ab12",
        "data": "bench",
        "data_hash": "cd34",
        "held_out_before": 0.2,
        "held_out_after": 0.05,
    }
    block = Block(condition(latents, seen), {"w": "rad/s"}, [Output("tau", "N.m", (Term("f"),))], seen, about)
    return write_block(block, folder / name)


def test_a_file_holds_where_its_block_comes_from(tmp_path):
    about = read_block(friction(tmp_path, "a.json", 0.4)).about
    assert about["model_version"] == "ab12"
    assert about["held_out_after"] == 0.05


def test_blocks_of_other_friction_differ_by_as_much_as_their_formulas_do(tmp_path):
    files = [str(friction(tmp_path, name, damping)) for name, damping in (("a.json", 0.4), ("b.json", 0.9))]
    done = CliRunner().invoke(blocks, [*files, "--json", str(tmp_path / "f.json"), "--html", str(tmp_path / "f.html")])
    assert done.exit_code == 0
    assert "held-out free run 0.2 to 0.05" in done.output.replace("\n", " ")
    (pair,) = json.loads((tmp_path / "f.json").read_text())["compared"]
    (tau,) = pair["outputs"]
    assert tau["difference"] == pytest.approx(0.5 * np.sqrt(np.mean(np.linspace(-3.0, 3.0, 15) ** 2)), rel=0.02)
    assert tau["inside"] < 0.2
    assert (tmp_path / "f.html").read_text().count("<img") >= 2


def test_a_block_agrees_with_itself(tmp_path):
    file = str(friction(tmp_path, "a.json", 0.4))
    done = CliRunner().invoke(blocks, [file, file, "--json", "-"])
    (pair,) = json.loads(done.output)["compared"]
    assert pair["outputs"][0]["inside"] == 1.0
