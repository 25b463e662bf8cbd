"""Make the students' exercises and the solutions from their one source, in nbgrader's format:  python notebooks/exercises/generate.py

``source/<name>/<name>.ipynb`` has solution regions and hidden tests. Students get ``<name>.ipynb``, with stubs and visible checks;
``solutions/<name>.ipynb`` has everything.
"""

import re
from pathlib import Path

import nbformat
from nbformat import NotebookNode
from nbgrader.converters import GenerateAssignment
from nbgrader.preprocessors import ClearSolutions, SaveCells

HERE = Path(__file__).parent
MARKERS = re.compile(r"^ *### (BEGIN|END) (SOLUTION|HIDDEN TESTS)\n?", re.MULTILINE)


class NamedStubs(ClearSolutions):
    """Stubs say which exercise they stand for: ``raise NotImplementedError("effect")``, by the cell's grade_id."""

    def preprocess_cell(self, cell, resources, cell_index):
        """Clear the solution of one cell."""
        name = cell.metadata.get("nbgrader", {}).get("grade_id", "")
        self.code_stub = {"python": f'raise NotImplementedError("{name}")'}
        return super().preprocess_cell(cell, resources, cell_index)


PREPROCESSORS = [
    NamedStubs if preprocessor is ClearSolutions else preprocessor
    for preprocessor in GenerateAssignment.preprocessors.default_args[0]
]


def student_version(source: NotebookNode) -> NotebookNode:
    """Return the notebook that students get, as nbgrader makes it (what it saves in its database left out)."""
    notebook, resources = nbformat.from_dict(source), {}
    for preprocessor in PREPROCESSORS:
        if preprocessor is not SaveCells:
            notebook, resources = preprocessor().preprocess(notebook, resources)
    return notebook


def solution_version(source: NotebookNode) -> NotebookNode:
    """Return the notebook with solutions and all tests, without the markers; it lies a folder deeper."""
    notebook = nbformat.from_dict(source)
    for cell in notebook.cells:
        cell.source = MARKERS.sub("", cell.source).rstrip("\n").replace("](../", "](../../")
        cell.metadata.pop("nbgrader", None)
    return notebook


def versions() -> dict[Path, str]:
    """Return what each generated file must hold, by its path."""
    texts = {}
    for path in sorted(HERE.glob("source/*/*.ipynb")):
        source = nbformat.read(path, as_version=4)
        texts[HERE / path.name] = nbformat.writes(student_version(source)) + "\n"
        texts[HERE / "solutions" / path.name] = (
            nbformat.writes(solution_version(nbformat.read(path, as_version=4))) + "\n"
        )
    return texts


def main() -> None:
    """Write all student and solution versions."""
    for path, text in versions().items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
