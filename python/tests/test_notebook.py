"""The notebook runs, cell by cell, and what it shows is right."""

import re
from pathlib import Path

import nbformat
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).parent.parent / "examples" / "diagnose.ipynb"


def test_the_notebook_names_what_is_hidden_and_the_error_falls():
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    NotebookClient(notebook, timeout=120, kernel_name="python3", resources={"metadata": {"path": str(NOTEBOOK.parent)}}).execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    said = "".join(output.get("text", "") for output in outputs)
    assert "missing-effect" in said and "adequate" in said, said
    before, after = map(float, re.search(r"leaves: ([\d.]+) -> ([\d.]+)", said).groups())
    assert before > 5 * after and after < 2, said
    true, found = map(float, re.search(r"true ([\d.]+) ms, found ([\d.]+) ms", said).groups())
    assert true == 12 and abs(found - true) < 0.1, said
    shown = [kind for output in outputs for kind in output.get("data", {})]
    assert shown.count("image/png") == 2 and shown.count("text/html") >= 3, shown
    assert any("<iframe sandbox=" in output.get("data", {}).get("text/html", "") for output in outputs)
