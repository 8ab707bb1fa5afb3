"""The notebook of the documentation runs, and finds what it says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

NOTEBOOK = Path(__file__).resolve().parents[2] / "docs/site/pages/tutorials/sun.ipynb"

# Values of the notebook's own names, as its last cell.
VALUES = """
import json
print(json.dumps({
    "most": hours.most, "suns": len(suns), "hours": hours.hours.tolist(), "unshaded": unshaded_hours.hours.tolist(),
    "hours_lost": hours_lost.tolist(), "energy_lost": energy_lost.tolist(), "energy": unshaded_energy.total.tolist(),
    "december": ax.lines[0].get_ydata().tolist(), "june": ax.lines[1].get_ydata().tolist(),
    "expected": (suns.directions[:, 2] * 4 > suns.directions[:, 1] * 3).sum().item(),
}))
"""


def test_the_notebook_is_kept_without_outputs() -> None:
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert len(code) >= 8
    assert not any(cell["outputs"] or cell["execution_count"] is not None for cell in code)


@pytest.fixture(scope="module")
def executed(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The notebook after it ran in a kernel of its own."""
    for package in ("nbclient", "ipykernel", "matplotlib", "pandas", "pvlib"):
        pytest.importorskip(package, reason=f"{package} is not installed: the notebook is not run")
    import nbformat
    from nbclient import NotebookClient

    notebook: Any = nbformat.read(NOTEBOOK, as_version=4)  # type: ignore[no-untyped-call]
    notebook.cells.append(nbformat.v4.new_code_cell(VALUES))  # type: ignore[no-untyped-call]
    folder = tmp_path_factory.mktemp("notebook")
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(folder)}}).execute()
    return notebook


def test_the_notebook_finds_hours_and_losses(executed: Any) -> None:
    values = json.loads(executed.cells[-1]["outputs"][0]["text"])
    hours, unshaded, lost = (np.array(values[name]) for name in ("hours", "unshaded", "hours_lost"))
    assert hours.shape == unshaded.shape == (960,) and lost.shape == (4, 6)
    # Alone, the roof sees every sun above its plane; each stands for an hour.
    assert set(unshaded) == {float(values["expected"])} and values["most"] == values["suns"] > values["expected"]
    assert (hours <= unshaded).all() and (lost > 0).all()
    energy_lost = np.array(values["energy_lost"])
    # The chimney stands before the fifth column, and upper rows see over it and over the neighbor.
    assert energy_lost.argmax() == 4
    assert (energy_lost[:-1] > energy_lost[1:]).all()
    assert abs(energy_lost[0, 4] - 0.45) < 0.02 and abs(energy_lost[3, 0] - 0.04) < 0.01
    # A clear year of 48 degrees north on 37 degrees of slope.
    assert 1300 < np.mean(values["energy"]) < 2300
    # The longest day has more sun than the shortest, and night is dark.
    assert max(values["june"]) == 1.0 and sum(values["june"]) > 1.5 * sum(values["december"]) > 0.0
    assert values["december"][0] == values["june"][0] == 0.0


def test_the_notebook_draws(executed: Any) -> None:
    pictures = [
        output for cell in executed.cells if cell.cell_type == "code" for output in cell.outputs if "image/png" in output.get("data", {})
    ]
    assert len(pictures) == 4
    assert any("text/html" in output.get("data", {}) for cell in executed.cells for output in cell.get("outputs", ()))
