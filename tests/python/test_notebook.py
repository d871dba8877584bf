"""docs/python.ipynb runs: its assertions hold, and the outputs that are stored in it are those of this version.

usage: python tests/python/test_notebook.py    runs the notebook and stores its outputs
"""

import copy
import shutil
import tempfile
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbformat import NotebookNode

ROOT = Path(__file__).parents[2]
PATH = ROOT / "docs" / "python.ipynb"
STORED = nbformat.read(PATH, as_version=4)

# Cells of this tag print times, which differ from run to run.
TIMES = "times"


def executed(notebook: NotebookNode, folder: Path) -> NotebookNode:
    """Returns a copy with the outputs of a run in a folder that has the models."""
    shutil.copytree(ROOT / "data" / "models", folder / "data" / "models")
    fresh = copy.deepcopy(notebook)
    for cell in code_cells(fresh):
        cell.outputs, cell.execution_count = [], None
    client = NotebookClient(
        fresh,
        timeout=600,
        kernel_name="python3",
        record_timing=False,
        coalesce_streams=True,
        resources={"metadata": {"path": str(folder)}},
    )
    return client.execute()


def code_cells(notebook: NotebookNode) -> list[NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def kinds(cell: NotebookNode) -> list[str]:
    """Returns the kinds of a cell's outputs: streams by name, others by their formats."""
    return [output.get("name") or "+".join([output.output_type, *sorted(output.get("data", {}))]) for output in cell.outputs]


def texts(cell: NotebookNode) -> list[str]:
    return [output.get("text") or output.get("data", {}).get("text/plain", "") for output in cell.outputs]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("notebook")


@pytest.fixture(scope="module")
def fresh(folder) -> NotebookNode:
    return executed(STORED, folder)


def test_cells_run_and_print_no_errors(fresh):
    for cell in code_cells(fresh):
        assert not {"error", "stderr"} & set(kinds(cell)), (cell.source, texts(cell))


def test_the_notebook_leaves_no_files(fresh, folder):
    assert [path.name for path in folder.iterdir()] == ["data"]
    assert {path.name for path in (folder / "data" / "models").iterdir()} == {
        path.name for path in (ROOT / "data" / "models").iterdir()
    }


def test_stored_outputs_are_of_the_kinds_of_a_run(fresh):
    for old, new in zip(code_cells(STORED), code_cells(fresh), strict=True):
        assert kinds(old) == kinds(new), f"{old.source}\nstored outputs are stale: python tests/python/test_notebook.py"
        assert old.execution_count == new.execution_count


def test_stored_texts_without_times_are_those_of_a_run(fresh):
    compared = 0
    for old, new in zip(code_cells(STORED), code_cells(fresh), strict=True):
        if TIMES not in old.metadata.get("tags", []):
            assert texts(old) == texts(new), f"{old.source}\nstored outputs are stale: python tests/python/test_notebook.py"
            compared += len(texts(old))
    assert compared >= 6


def test_each_section_asserts_its_numbers():
    sections: dict[str, int] = {}
    title = ""
    for cell in STORED.cells:
        if cell.cell_type == "markdown" and cell.source.startswith("## "):
            title = cell.source.splitlines()[0]
            sections[title] = 0
        elif cell.cell_type == "code" and title:
            sections[title] += cell.source.count("assert ")
    assert len(sections) == 6 and min(sections.values()) >= 2, sections


def test_a_number_that_is_wrong_fails(tmp_path):
    notebook = copy.deepcopy(STORED)
    right = "volume = scaffold.volume()"
    (index,) = [i for i, cell in enumerate(notebook.cells) if cell.source.startswith(right)]
    notebook.cells = notebook.cells[: index + 1]
    notebook.cells[index].source = notebook.cells[index].source.replace(right, "volume = scaffold.offset(0.1).volume(resolution=32)")
    with pytest.raises(CellExecutionError, match="AssertionError"):
        executed(notebook, tmp_path)


def test_the_file_is_small_and_names_no_machine():
    text = PATH.read_text()
    assert len(text) < 1_500_000
    for place in ("/home/", "/tmp/", "/root/", "/work/", "/usr/", "site-packages", "Users"):
        assert place not in text, place
    assert all(set(cell.metadata) <= {"tags"} for cell in STORED.cells)


def store() -> None:
    with tempfile.TemporaryDirectory() as folder:
        notebook = executed(STORED, Path(folder))
    for cell in notebook.cells:
        cell.metadata = {key: value for key, value in cell.metadata.items() if key == "tags"}
    notebook.metadata = {key: STORED.metadata[key] for key in ("kernelspec", "language_info")}
    notebook.metadata["language_info"] = {"name": "python"}
    nbformat.validate(notebook)
    nbformat.write(notebook, PATH)


if __name__ == "__main__":
    store()
