"""The notebook runs from its first cell to its last."""

from pathlib import Path

import pytest

NOTEBOOKS = Path(__file__).resolve().parents[1] / "notebooks"


def test_the_notebook_ends_with_a_corrected_mujoco_model():
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("mujoco")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(NOTEBOOKS / "csv-to-mujoco.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": NOTEBOOKS}}).execute()
    printed = [
        output["text"]
        for cell in notebook.cells
        for output in cell.get("outputs", [])
        if output["output_type"] == "stream"
    ]
    assert "mm in MuJoCo" in printed[-1], printed
